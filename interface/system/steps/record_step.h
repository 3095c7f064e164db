// SPDX-License-Identifier: BSD-3-Clause
//
// Records a step of a system.
//
//   RecordedStep r = record_step(pendulum, Integrator::kImplicitMidpoint);
//
// An explicit scheme is one function, `end`, of variables x and parameters (t, h, u, p).  An implicit scheme has
// unknowns z (n_z): the change of v, or the displacement xi of a variational step.  Then `residual` (n_z) and `end`
// are functions of variables z and parameters (x, t, h, u, p).  `end` returns x'.
#pragma once

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/interface/system/system.h>

namespace dyntape {

struct RecordedStep {
  int nx = 0, nt = 0, n_z = 0;  // n_z = 0: explicit
  Function residual, end;
};
RecordedStep record_step(const System& system, Integrator integrator);

// The Jacobians of a step, split where the scheme evaluates the dynamics (step_scheme.h): at n_points points (t, q,
// v, drive).  As one function, the Jacobians of a step of four stages would contain the derivatives of the dynamics
// ten times.
//   points     the points, of parameters (x, t, h, u, p, z):  rows (t, q, v, drive)
//   dynamics   of variables (dq, v, drive, p) and parameters (t, q), at dq = 0:  values (n_dynamics), then their
//              Jacobian
//   chain      of variables (values at all points, z, dx, u) and parameters (x, t, h, q of all points, x'), at dx = 0:
//              non-zeros of the Jacobian of rows (dq, dv, d drive of each point, residual, dx')
// Increments are set to zero after differentiation, so that moving the state costs nothing.  For a variational step
// z is (xi, v'), and the momentum at the end is an additional residual.
struct RecordedJacobians {
  int n_points = 0, n_dynamics = 0, n_z = 0;
  Function points, dynamics, chain;
  Pattern of_dynamics, of_chain;
};
RecordedJacobians record_jacobians(const System& system, Integrator integrator);

// The name of an entry of (x, t, h, u, p) for messages: q.<joint>, v.<joint>, with an index if a joint has several;
// m[<motor>], t, h, u[<motor>], p[<parameter>].
std::string argument_name(const System& system, int entry);

}  // namespace dyntape
