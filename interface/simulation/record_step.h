// SPDX-License-Identifier: BSD-3-Clause
//
// A step of a system as recorded functions.
//
//   RecordedStep r = record_step(pendulum, Integrator::kImplicitMidpoint);
//
// An explicit scheme is one function, `end`, of variables x and parameters (t, h, u, p).  An implicit one has unknowns
// z (n_z): the change of v, or the displacement xi of a variational step; then `residual` (n_z) and `end` are functions
// of variables z and parameters (x, t, h, u, p).  Both ends are x'.
//
// The Jacobians of a step come from one more function of variables (z, dx, u, p) and parameters (x, t, h, x'): all
// non-zeros of d(residual, x' (-) its value) / d(z, dx, u, p), with dx (nt) an increment of the state, at dx = 0.  It
// is derived before dx is bound to zero, so that what moves the state costs nothing where it stands still.
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/interface/simulation/system.h>

namespace dyntape {

struct RecordedStep {
  int nx = 0, nt = 0, n_z = 0;  // no unknowns: explicit
  Function residual, end;
};

struct RecordedJacobians {
  Function function;  // the non-zeros
  Pattern pattern;    // (n_z + nt) x (n_z + nt + n_u + n_p)
};

RecordedStep record_step(const System& system, Integrator integrator);
RecordedJacobians record_jacobians(const System& system, Integrator integrator);

// Of an entry of (x, t, h, u, p), for sentences: q.<joint>, v.<joint>, with an index where a joint has several; m[<motor>],
// t, h, u[<motor>], p[<parameter>].
std::string argument_name(const System& system, int entry);

}  // namespace dyntape
