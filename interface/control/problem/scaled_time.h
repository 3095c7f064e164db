// SPDX-License-Identifier: BSD-3-Clause
//
// Converts a problem of free duration to a problem over fixed time: the duration T is an additional last state,
// constant.
//
//   Problem q = scaled_time(p);                // p has p.free_duration(0.5, 4); q.duration is 1
//   t = T tau,  tau in [0, 1]                  dx/dtau = T f(t, x, a, u),   dT/dtau = 0
//   running costs                              T L;   of squares r:  sqrt(T) r
//   other terms, the residual                  unchanged, at the real time t
//   the state "duration"                       within the range at every point; first guess: T of the first guess
//
// No other code scales time.  A staged program discretises q, and returns the motions of p, in real time.  A problem
// of given duration is returned unchanged.
#pragma once

#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

Problem scaled_time(const Problem& problem);

}  // namespace dyntape
