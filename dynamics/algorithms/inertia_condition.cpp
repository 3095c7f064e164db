// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/algorithms/inertia_condition.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <dyntape/dynamics/model/configuration.h>

namespace dyntape::dynamics {
namespace {

// Each angle to a multiple of a right one.
void align(const Model<double>& model, std::mt19937_64& random, VectorX<double>& q) {
  constexpr double kRightAngle = 1.57079632679489661923;
  for (const Joint<double>& joint : model.joints) {
    if (traits(joint.type).has_angle) q[joint.idx_q] = static_cast<double>(random() % 4) * kRightAngle;
  }
}

}  // namespace

double inertia_condition(const Model<double>& model, Data<double>& data, const VectorRef<double>& q) {
  crba<double>(model, data, q);
  minverse<double>(model, data, q);
  double condition = 1;
  for (int k = 0; k < model.nv; ++k) {
    const double of_dof = data.M(k, k) * data.Minv(k, k);
    if (!(of_dof <= condition)) condition = of_dof;
    if (!std::isfinite(condition)) break;
  }
  return condition;
}

double worst_inertia_condition(const Model<double>& model) {
  constexpr int kConfigurations = 16;
  Data<double> data(model);
  std::mt19937_64 random(1);
  double worst = 1;
  for (int n = 0; n < kConfigurations; ++n) {
    VectorX<double> q = random_configuration<double>(model, random);
    for (const bool aligned : {false, true}) {
      if (aligned) align(model, random, q);
      const double condition = inertia_condition(model, data, q);
      if (!std::isfinite(condition)) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, condition);
    }
  }
  return worst;
}

}  // namespace dyntape::dynamics
