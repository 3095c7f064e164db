// SPDX-License-Identifier: BSD-3-Clause
//
// The barrier parameter mu of an interior-point step.
//
// Adaptive: a Newton step is linear in mu, affine + mu centring, so two solves with one factorisation tell what a step for any
// mu leads to.  The quality function foresees the error behind it,
//
//   q(mu) = (1 - a_d)^2 |dual|^2 / n  +  (1 - a_p)^2 |c|^2 / m  +  sum of (distance x multiplier)^2 behind the step / bounds
//
// with the step lengths a_p, a_d that the bounds allow; a golden-section search over ln mu minimises it.  Where the error has not
// fallen for some steps, mu is fixed and lowered as the barrier problems are solved (monotone), until the error falls again.  Where the
// least error of the solve stays the least for many adaptive steps, mu is monotone to the end: they could go round for ever.
//
// The first barrier problem is solved as it is, so that a start far away is led by all bounds; a warm start adapts at once.
//
//   BarrierMode mode;                                     // of a solve
//   if (mode.is_adaptive(error, is_stalled)) mu = QualityFunction(barrier, w, multipliers, affine, centring).minimum(...);
//
// Source: J. Nocedal, A. Wächter, R. Waltz, Adaptive barrier update strategies for nonlinear interior methods, SIAM Journal on
// Optimization 19(4), 2009.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>
#include <vector>

#include <dyntape/interface/control/riccati/barrier.h>

namespace dyntape {

// Whether a step's mu is chosen anew or held.
class BarrierMode {
 public:
  explicit BarrierMode(bool may_adapt = true) : may_adapt_(may_adapt) {}
  // At a point whose optimality error is `error`; `is_stalled`: the last step was as small as rounding.
  bool update(double error, bool is_stalled);
  bool is_adaptive() const { return is_adaptive_; }
  // From here on monotone, as behind a restoration, whose filter has to last.  True: it was not before.
  bool end() { return is_adaptive_ = false, std::exchange(may_adapt_, false); }

 private:
  bool may_adapt_, is_adaptive_ = false;
  std::vector<double> errors_;  // of the last points of adaptive steps
  double least_ = HUGE_VAL;
  int since_least_ = 0;  // adaptive steps
};

class QualityFunction {
 public:
  // Steps of w for mu = 0, and by mu.
  QualityFunction(const Barrier& barrier, const Eigen::VectorXd& w, const BoundMultipliers& multipliers,
                  const Eigen::VectorXd& affine, const Eigen::VectorXd& centring);

  // dual, primal: the sums of squares, each over its number; tau: the part of a distance that a step may take.  The best mu
  // between `least` and `most`.
  double minimum(double dual, double primal, double tau, double least, double most) const;

 private:
  double value(double mu, double dual, double primal, double tau) const;

  // A row a bound: the product of distance and multiplier, and by how much of itself either grows, affinely and by mu.
  Eigen::ArrayXXd bounds_;  // (bounds x 5)
  double mean_ = 0;         // of the products
};

}  // namespace dyntape
