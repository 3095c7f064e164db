// SPDX-License-Identifier: BSD-3-Clause
//
// Long chains, extreme masses and speeds: double against the same algorithms in 113 bits.
#include <gtest/gtest.h>

#include <dyntape/dynamics/algebra/float128.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::hard_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Model<double> chain(Random& random, int n) {
  Model<double> model = random_tree(random, {n, Base::kFixed, true});
  for (auto& j : model.joints) j.armature = 0;
  return model;
}

Model<double> turning_chain(Random& random, int n) {
  Model<double> model;
  for (int i = 0; i < n; ++i) {
    model.add_joint(i - 1, random_joint(random, "joint " + std::to_string(i), JointType::kRevolute),
                    random_placement(random), random_inertia(random));
    model.joints[i].armature = 0;
  }
  return model;
}

void scale_body(Model<double>& model, int i, double factor) {
  model.inertias[i].mass *= factor;
  model.inertias[i].I_c *= factor;
}

// Forward error of ABA: |a - a_exact| / |a_exact|.
double aba_error(const Model<double>& model, const State& s) {
  Data<double> data(model);
  const Model<Float128> exact = model.cast<Float128>();
  Data<Float128> data128(exact);
  const VectorXd a = aba(model, data, s.q, s.v, s.tau);
  const VectorX<Float128> a128 =
      aba<Float128>(exact, data128, s.q.cast<Float128>(), s.v.cast<Float128>(), s.tau.cast<Float128>());
  return relative_error(a.cast<Float128>(), a128);
}

// The residual that is fair: |M a + h - tau| against the size of its terms.
double scaled_residual(const Model<double>& model, const State& s) {
  Data<double> data(model);
  const VectorXd a = aba(model, data, s.q, s.v, s.tau), tau = rnea(model, data, s.q, s.v, a);
  const VectorXd h = nonlinear_effects(model, data, s.q, s.v);
  return (tau - s.tau).norm() / (crba(model, data, s.q).norm() * a.norm() + h.norm());
}

TEST(Hard, ChainsOfUpTo300Joints) {
  for (const int n : {10, 100, 300}) {
    Random random(n);
    const Model<double> model = chain(random, n);
    const State s = random_state(model, random);
    EXPECT_LE(aba_error(model, s), 1e-12) << n;
    EXPECT_LE(scaled_residual(model, s), n * 0x1p-52) << n;
  }
}

// Bodies of a chain made heavier or lighter.
enum Masses { kHeavyLeaf6, kHeavyLeaf9, kLightLeaf12, kAlternating6, kGeometric9, kMassesEnd };

double factor(int masses, int i, int n) {
  const bool last = i == n - 1;
  const double factors[] = {last ? 1e6 : 1, last ? 1e9 : 1, last ? 1e-12 : 1, i % 2 ? 1e6 : 1,
                            std::pow(1e9, i / (n - 1.0))};
  return factors[masses];
}

// A few joints in general position all feel a heavy leaf, and the accelerations are as accurate as ever.
TEST(Hard, MassRatiosUpToABillion) {
  constexpr int n = 4;
  for (unsigned long seed = 1; seed <= 50; ++seed) {
    for (int masses = 0; masses < kMassesEnd; ++masses) {
      Random random(seed);
      Model<double> model = turning_chain(random, n);
      for (int i = 0; i < n; ++i) scale_body(model, i, factor(masses, i, n));
      const State s = random_state(model, random);
      EXPECT_LE(aba_error(model, s), 1e-12) << "seed " << seed << " masses " << masses;
      EXPECT_LE(scaled_residual(model, s), n * 0x1p-52) << "seed " << seed << " masses " << masses;
    }
  }
}

// Beyond six joints a heavy leaf leaves directions in which only light links move: the difference of heavy inertias
// determines them, and any recursion in double loses the ratio (the residual does not).
TEST(Hard, RedundantChainsLoseNoMoreThanTheMassRatio) {
  constexpr int n = 8;
  for (unsigned long seed = 1; seed <= 5; ++seed) {
    for (int masses = 0; masses < kMassesEnd; ++masses) {
      Random random(seed);
      Model<double> model = chain(random, n);
      for (int i = 0; i < n; ++i) scale_body(model, i, factor(masses, i, n));
      const State s = random_state(model, random);
      const double ratio = masses == kHeavyLeaf6 || masses == kAlternating6 ? 1e6 : 1e9;
      const double freedom = model.nv / double(n);  // a joint may count for three
      EXPECT_LE(aba_error(model, s), 10 * freedom * ratio * 0x1p-52)
          << "seed " << seed << " masses " << masses;
      EXPECT_LE(scaled_residual(model, s), n * 0x1p-52) << "seed " << seed << " masses " << masses;
    }
  }
}

TEST(Hard, SpeedsOfAMillion) {
  Random random(1);
  const Model<double> model = random_tree(random, {10, Base::kFloating});
  State s = random_state(model, random);
  s.v *= 1e6;
  EXPECT_LE(aba_error(model, s), 1e-12);
}

// An inertia kept at the centre of mass loses nothing when its body is far from its frame.
TEST(Hard, FarCentreOfMassKeepsTheRotationalInertia) {
  Random random(2);
  const Inertia<double> body = random_inertia(random);
  const Placement<double> away{exp(random.vector3(3)), Vector3<double>(6e3, -8e3, 1e2)};
  const Inertia<double> back = act(inverse(away), act(away, body));
  EXPECT_LE(relative_error(back.I_c, body.I_c), 1e-12);
  EXPECT_LE((back.com - body.com).norm(), 1e-11);
}

// Rotor inertia seen through a gear: n^2 I_r, and the link's own stays beside it.
TEST(Hard, ArmatureThatDominatesLeavesTheLink) {
  Random random(3);
  Model<double> model;
  model.add_joint(-1, random_joint(random, "geared", JointType::kRevolute), {},
                  {1e-3, Vector3<double>::Zero(), Matrix3<double>::Identity() * 1e-3});
  model.joints[0].armature = 1e3 * 1e3 * 1e-6;
  Data<double> data(model);
  EXPECT_NEAR(crba(model, data, neutral(model))(0, 0), 1.001, 1e-15);
}

// Angles of 1e8 rad are as good as their remainder.
TEST(Hard, ManyTurns) {
  Random random(4);
  Model<double> model = chain(random, 6);
  State s = random_state(model, random);
  for (int i = 0; i < 6; ++i) {
    if (model.joints[i].type == JointType::kRevolute) s.q[model.joints[i].idx_q] += 1e8;
  }
  EXPECT_LE(aba_error(model, s), 1e-12);
}

// Single precision follows the same path: an error of its own rounding.
TEST(Hard, SinglePrecision) {
  Random random(5);
  const Model<double> model = chain(random, 7);
  const State s = random_state(model, random);
  const Model<float> single = model.cast<float>();
  Data<float> data_single(single);
  Data<double> data(model);
  const VectorX<float> tau =
      rnea<float>(single, data_single, s.q.cast<float>(), s.v.cast<float>(), s.a.cast<float>());
  EXPECT_LE(relative_error(tau.cast<double>(), rnea(model, data, s.q, s.v, s.a)), 1e-5);
}

}  // namespace
}  // namespace dyntape::dynamics::hard_test
