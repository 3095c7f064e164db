// SPDX-License-Identifier: BSD-3-Clause
//
// A problem whose rate is what steps make of the state, the controls held: Euler's collocation of it is multiple shooting.
//
//   const Problem q = multiple_shooting(p, ShootingScheme::kRungeKutta4, 2, interval_lengths(nodes));
//
//   rate             (Phi(t, x, u) - x) / h, Phi so many steps of length h / steps one after another
//   running costs    1/h int L dt by the same steps; of squares the residuals whose squares add up to that
//   other terms      as they are, at the beginning of an interval
//   parameters       those of p first, whose handles hold; the interval's length h; those of p at the middle and the end of
//                    each step, but not beyond the end of the problem
//
//   kRungeKutta4     the classical scheme of (x, int L), fourth order
//   kEuler           x' = x + h f(x, u), int L = h L(x, u), first order; of the parameters those at the beginning.  States that
//                    the problem says are positions move by the new velocities: semi-implicit, which keeps energies.  Accelerations
//                    of the inverse form hold over the interval: one step, its equations at the beginning
//
// ArgumentError, when the rate is asked for, unless it has one entry a state; for the inverse form, whose rate is no function
// of states and controls, but of one kEuler step; for less than one step.
#pragma once

#include <functional>
#include <vector>

#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

enum class ShootingScheme { kRungeKutta4, kEuler };

// How long the interval is that begins at a time (s).
using IntervalLength = std::function<double(double t)>;
IntervalLength interval_lengths(std::vector<double> nodes);

Problem multiple_shooting(const Problem& problem, ShootingScheme scheme, int steps,
                          const IntervalLength& length);

}  // namespace dyntape
