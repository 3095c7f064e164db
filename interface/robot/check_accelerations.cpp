// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/robot/check_accelerations.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <dyntape/codegen/system/warn_once.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/dynamics/algorithms/inertia_condition.h>

namespace dyntape::detail {

void check_accelerations(const dynamics::Model<double>& model, const RobotFunction& function) {
  constexpr double kWorthANote = 1e12;
  if (!is_forward(function)) return;
  dynamics::check_forward_dynamics(model);
  if (!function.mimics.empty()) return;
  const double condition = dynamics::worst_inertia_condition(model);
  if (condition <= kWorthANote || !std::isfinite(condition)) return;
  char figure[32];
  std::snprintf(figure, sizeof figure, "%.1e", condition);
  codegen::warn_once("the inertia matrix of model \"" + model.name + "\" has a condition of " + figure +
                     " (the largest M_kk (M^-1)_kk; below 1e+12 is usual): derivatives of its accelerations "
                     "may lose up to " +
                     std::to_string(std::lround(std::min(16.0, std::log10(condition)))) + " of 16 digits");
}

}  // namespace dyntape::detail
