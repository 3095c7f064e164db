// SPDX-License-Identifier: BSD-3-Clause
//
// Chooses the barrier parameter mu of an interior-point step.
//
// Adaptive: a Newton step is linear in mu, affine + mu centring, so two solves with one factorisation give the step
// for any mu.  The quality function predicts the error after the step,
//
//   q(mu) = (1 - a_d)^2 |dual|^2 / n  +  (1 - a_p)^2 |c|^2 / m  +  sum of (distance x multiplier)^2 after the step /
//                                     bounds
//
// with the step lengths a_p, a_d that the bounds allow.  A golden-section search over ln mu minimises it.  If the
// error has not decreased for some steps, mu is fixed and lowered as the barrier problems are solved (monotone),
// until the error decreases again.  If the least error of the solve is not improved for many adaptive steps, mu
// stays monotone to prevent cycling.
//
// The first barrier problem uses a fixed mu, so that all bounds guide a distant start.  A warm start is adaptive at
// once.
//
//   BarrierMode mode;                                     // of a solve
//   if (mode.is_adaptive(error, is_stalled)) mu = QualityFunction(barrier, w, multipliers, affine,
//   centring).minimum(...);
//
// Source: J. Nocedal, A. Wächter, R. Waltz, Adaptive barrier update strategies for nonlinear interior methods, SIAM
// Journal on Optimization 19(4), 2009.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>
#include <vector>

#include <dyntape/interface/control/riccati/barrier.h>

namespace dyntape {

// Whether a step's mu is chosen or kept.
class BarrierMode {
 public:
  explicit BarrierMode(bool may_adapt = true) : may_adapt_(may_adapt) {}
  // At a point with optimality error `error`; `is_stalled`: the last step was as small as rounding.
  bool update(double error, bool is_stalled);
  bool is_adaptive() const { return is_adaptive_; }
  // Switches to the monotone update (after a restoration the filter must stay valid).  Returns whether it was
  // adaptive.
  bool end() { return is_adaptive_ = false, std::exchange(may_adapt_, false); }

 private:
  bool may_adapt_, is_adaptive_ = false;
  std::vector<double> errors_;  // of the last adaptive steps
  double least_ = HUGE_VAL;
  int since_least_ = 0;  // adaptive steps since the least error
};

class QualityFunction {
 public:
  // Steps of w for mu = 0, and per unit of mu.
  QualityFunction(const Barrier& barrier, const Eigen::VectorXd& w, const BoundMultipliers& multipliers,
                  const Eigen::VectorXd& affine, const Eigen::VectorXd& centring);

  // dual, primal: sums of squares, each over its number; tau: the largest fraction of a distance for a step.
  // Returns the best mu in [least, most].
  double minimum(double dual, double primal, double tau, double least, double most) const;

 private:
  double value(double mu, double dual, double primal, double tau) const;

  // One row per bound: the product of distance and multiplier, and the relative changes of both, affine and per unit
  // of mu.
  Eigen::ArrayXXd bounds_;  // (bounds x 5)
  double mean_ = 0;         // of the products
};

}  // namespace dyntape
