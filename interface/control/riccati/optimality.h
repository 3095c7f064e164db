// SPDX-License-Identifier: BSD-3-Clause
//
// The error of a point and its multipliers in the conditions of the barrier problem.
//
//   dual            largest entry of  grad f + J^T lambda - z_lower + z_upper,  (x, s) as Barrier has them
//   primal          largest entry of  c
//   complementarity largest           | z (w - bound) - mu |
//   all             the largest of them, the first and the last divided by the mean multiplier if that is above 100
//
// Source: Wächter and Biegler 2006, equations 5 and 6.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include <dyntape/interface/control/riccati/barrier.h>

namespace dyntape {

struct OptimalityErrors {
  double dual, primal, complementarity, all;
};

// Counts iterations without a change of the objective: acceptable ones, and those in which neither error decreases
// by a tenth.  Iterations that are not acceptable do not reset the count: if the curvature is below rounding, steps
// fail repeatedly.
class Progress {
 public:
  Progress() = default;
  explicit Progress(double objective) : objective_(objective) {}
  void note(bool is_acceptable, double objective, const OptimalityErrors& e) {
    constexpr double kStill = 1e-6, kFallen = 0.9;
    if (!(std::abs(objective - objective_) <= kStill * std::max(std::abs(objective), 1.0)))
      *this = Progress(objective);
    if (is_acceptable) ++acceptable_;
    ++idle_;
    for (const auto& [now, least] : {std::pair(e.all, &all_), std::pair(e.primal, &primal_)})
      if (now < kFallen * *least) *least = now, idle_ = 0;
  }
  int acceptable() const { return acceptable_; }
  bool has_stalled() const { return idle_ >= kMostIdle; }

 private:
  static constexpr int kMostIdle = 30;
  double objective_ = HUGE_VAL, all_ = HUGE_VAL, primal_ = HUGE_VAL;
  int acceptable_ = 0, idle_ = 0;
};

class Optimality {
 public:
  Optimality(const Barrier& barrier, const StagewiseKkt& kkt) : barrier_(barrier), kkt_(kkt) {}

  // For the point of the Jacobian in `kkt`: the part that does not depend on mu.
  void look(const Eigen::VectorXd& gradient, const Eigen::VectorXd& lambda,
            const BoundMultipliers& multipliers);
  OptimalityErrors errors(const BarrierPoint& point, const BoundMultipliers& multipliers, double mu) const;
  const Eigen::VectorXd& stationarity() const { return stationarity_; }  // (n + m)
  const Eigen::VectorXd& lagrangian() const { return lagrangian_; }      // (n) grad f + J^T lambda

 private:
  const Barrier& barrier_;
  const StagewiseKkt& kkt_;
  Eigen::VectorXd stationarity_, lagrangian_;
  double dual_ = 0, dual_scale_ = 1, multiplier_scale_ = 1;
};

}  // namespace dyntape
