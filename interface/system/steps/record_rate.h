// SPDX-License-Identifier: BSD-3-Clause
//
// Records the rate of a system within an adaptive step.
//
//   RecordedRate r = record_rate(pendulum, Integrator::kAdaptive);
//
// The step starts at t in x = (q, v, m).  At time s after the start the system is at q_c (+) d with velocity v; the
// centre q_c is a configuration near the path.  With J(d) the Jacobian of integrate for increments of d in the
// moving frame,
//
//   d' = J(d)^-1 v      v' = acceleration at (t + s, q_c (+) d, v, drive(m, u, s), p)
//
// and the lagged motors are at u + (m - u) exp(-s / lag).  `given` are (q_c, m, u, p, t, s).
//   rate      of variables (d, v) and parameters given:  (d', v')
//   by_all    of variables (d, v, m, u, p) and parameters (q_c, t, s):  the same
//   state     of parameters (d, v, given):  x at this time
//   frame     of parameters (d, s):  J(d) by columns (nv^2), then exp(-s / lag) (n_m)
//   events    of parameters (x, t, u, p):  g (n_g), if there is one
#pragma once

#include <dyntape/interface/system/system.h>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

struct RecordedRate {
  int nq = 0, nv = 0, n_m = 0, n_g = 0;
  Function rate, by_all, state, frame, events;
};

RecordedRate record_rate(const System& system, Integrator integrator);

}  // namespace dyntape
