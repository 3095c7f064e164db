// SPDX-License-Identifier: BSD-3-Clause
//
// Replaces the dynamics of a problem by integration steps with constant controls.  Euler collocation of the result
// is multiple shooting.
//
//   const Problem q = multiple_shooting(p, ShootingScheme::kRungeKutta4, 2, interval_lengths(nodes));
//
//   rate             (Phi(t, x, u) - x) / h, with Phi a sequence of steps of length h / steps
//   running costs    1/h int L dt by the same steps; for squares the residuals whose squares add up to it
//   other terms      unchanged, at the beginning of an interval
//   parameters       those of p first, whose handles stay valid; the interval's length h; those of p at the middle
//                    and the end of each step, but not after the end of the problem
//
//   kRungeKutta4     the classical scheme for (x, int L), fourth order
//   kEuler           x' = x + h f(x, u), int L = h L(x, u), first order; parameters at the beginning.  States
//                    declared as positions move by the new velocities (semi-implicit).  In the inverse form
//                    accelerations are constant over the interval: one step, with its equations at the beginning
//
// Errors.  ArgumentError: when the rate is evaluated, unless it has one entry per state; the inverse form with
// anything except one kEuler step; less than one step.
// of states and controls, but of one kEuler step; for less than one step.
#pragma once

#include <functional>
#include <vector>

#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

enum class ShootingScheme { kRungeKutta4, kEuler };

// The length of the interval that begins at a time (s).
using IntervalLength = std::function<double(double t)>;
IntervalLength interval_lengths(std::vector<double> nodes);

Problem multiple_shooting(const Problem& problem, ShootingScheme scheme, int steps,
                          const IntervalLength& length);

}  // namespace dyntape
