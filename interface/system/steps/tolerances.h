// SPDX-License-Identifier: BSD-3-Clause
//
// Adaptive steps: what they are asked for, and what became of them.
#pragma once

namespace dyntape {

// What an adaptive step allows in each internal step: relative * size + absolute (step_problem.h says which sizes).
struct Tolerances {
  static constexpr double kLeastRelative = 1e-14, kMostRelative = 0.1;
  double relative = 1e-10, absolute = 1e-13;
};

// An adaptive step ended where an entry of System::events fell to zero.
struct StepEvent {
  int entry;  // the first, if there are several at once
  double t;   // (s)
};

// What an adaptive step took.
struct StepEffort {
  long internal_steps = 0, rates = 0, jacobians = 0;

  StepEffort& operator+=(const StepEffort& other) {
    internal_steps += other.internal_steps, rates += other.rates, jacobians += other.jacobians;
    return *this;
  }
};

}  // namespace dyntape
