// SPDX-License-Identifier: BSD-3-Clause
//
// Tolerances and results of adaptive steps.
#pragma once

namespace dyntape {

// Limit of the error of each internal step: relative * size + absolute (step_problem.h defines the sizes).
struct Tolerances {
  static constexpr double kLeastRelative = 1e-14, kMostRelative = 0.1;
  double relative = 1e-10, absolute = 1e-13;
};

// The event that ended an adaptive step: an entry of System::events fell to zero.
struct StepEvent {
  int entry;  // the first, if several are simultaneous
  double t;   // (s)
};

// The cost of an adaptive step.
struct StepEffort {
  long internal_steps = 0, rates = 0, jacobians = 0;

  StepEffort& operator+=(const StepEffort& other) {
    internal_steps += other.internal_steps, rates += other.rates, jacobians += other.jacobians;
    return *this;
  }
};

}  // namespace dyntape
