// SPDX-License-Identifier: BSD-3-Clause
//
// Regularization of the Hessian by multiples of the identity: damping after steps that were too long, and correction
// of the inertia.
//
//   HessianShift shift;
//   double s = shift.damping();
//   if (!factor(H, s)) for (s = shift.first(); !factor(H, s); s = shift.larger(s)) {}
//   shift.note(trials, s);    // after the line search
//
// Damping.  If an optimum is nearly flat along a curved valley, Newton's step is long and leaves the valley: the
// line search halves it ten times, and the next step is as long again.  After five or more halvings the shift is
// multiplied by eight, starting at 1e-4.  After at most one halving it is divided by eight.  Damping does not change
// the optimum.
//
// Inertia: Wächter and Biegler 2006, algorithm IC.
#pragma once

#include <algorithm>

namespace dyntape {

class StepDamping {
 public:
  double shift() const { return shift_; }

  // `trials`: points of the line search.  `used`: the total shift of that step.
  void note(int trials, double used) {
    if (trials > kMany)
      shift_ = std::min(std::max(kFirst, kFactor * used), kMost);
    else if (trials <= kFew)
      shift_ = shift_ > kLeast ? shift_ / kFactor : 0;
  }

 private:
  static constexpr int kMany = 5, kFew = 2;
  static constexpr double kFirst = 1e-4, kFactor = 8, kLeast = 1e-9, kMost = 1e2;  // for the scaled program
  double shift_ = 0;
};

class HessianShift {
 public:
  static constexpr double kMost = 1e20;  // largest shift

  double damping() const { return damping_.shift(); }
  double first() {
    return tried_ = std::max(8 * damping(), last_ == 0 ? kFirst : std::max(kLeast, last_ / 3));
  }
  double larger(double shift) { return tried_ = shift * (last_ == 0 ? 100 : 8); }
  // Call it after the line search of a step whose Hessian had `used`.
  void note(int trials, double used) {
    if (used == tried_ && used > 0) last_ = used;
    damping_.note(trials, used);
  }

 private:
  static constexpr double kFirst = 1e-4, kLeast = 1e-20;
  double last_ = 0, tried_ = 0;
  StepDamping damping_;
};

}  // namespace dyntape
