// SPDX-License-Identifier: BSD-3-Clause
//
// A problem of free duration as one over a fixed time: its duration T is one more state, the last, and constant.
//
//   Problem q = scaled_time(p);                // p.free_duration(0.5, 4) was said; q.duration is 1
//   t = T tau,  tau in [0, 1]                  dx/dtau = T f(t, x, a, u),   dT/dtau = 0
//   running costs                              T L;   of squares r:  sqrt(T) r
//   other terms, the residual                  as they are, at the real time t
//   the state "duration"                       within the range at every point, T of the first guess at first
//
// Here and nowhere else is it known how time is scaled; a staged program is that of q and its motions are of p, in real time.
// A problem of given duration comes back as it is.
#pragma once

#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

Problem scaled_time(const Problem& problem);

}  // namespace dyntape
