// SPDX-License-Identifier: BSD-3-Clause
//
// Multiples of the identity that are added to the Hessian of a step: after steps that were too long, and where it has the wrong inertia.
//
//   HessianShift shift;
//   double s = shift.damping();
//   if (!factor(H, s)) for (s = shift.first(); !factor(H, s); s = shift.larger(s)) {}
//   shift.note(trials, s);    // after the line search
//
// Damping.  Where an optimum is nearly flat along a curved valley, Newton's step is long and leaves the valley: a line search halves the
// step ten times, and the next step is as long again.  Five halvings or more multiply the shift by eight, from 1e-4 on; a step that is
// accepted after at most one halving divides it by eight.  Damping does not move the optimum.
//
// Inertia: Wächter and Biegler 2006, algorithm IC.
#pragma once

#include <algorithm>

namespace dyntape {

class StepDamping {
 public:
  double shift() const { return shift_; }

  // `trials`: points that the line search looked at.  `used`: the whole shift of that step.
  void note(int trials, double used) {
    if (trials > kMany)
      shift_ = std::min(std::max(kFirst, kFactor * used), kMost);
    else if (trials <= kFew)
      shift_ = shift_ > kLeast ? shift_ / kFactor : 0;
  }

 private:
  static constexpr int kMany = 5, kFew = 2;
  static constexpr double kFirst = 1e-4, kFactor = 8, kLeast = 1e-9, kMost = 1e2;  // of the scaled program
  double shift_ = 0;
};

class HessianShift {
 public:
  static constexpr double kMost = 1e20;  // beyond, there is none

  double damping() const { return damping_.shift(); }
  double first() {
    return tried_ = std::max(8 * damping(), last_ == 0 ? kFirst : std::max(kLeast, last_ / 3));
  }
  double larger(double shift) { return tried_ = shift * (last_ == 0 ? 100 : 8); }
  // After the line search of a step whose Hessian had `used`.
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
