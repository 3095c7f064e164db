// SPDX-License-Identifier: BSD-3-Clause
//
// A step of a system as recorded functions.
//
//   RecordedStep r = record_step(pendulum, Integrator::kImplicitMidpoint);
//
// An explicit scheme is one function, `end`, of variables x and parameters (t, h, u, p).  An implicit one has unknowns
// z (n_z): the change of v, or the displacement xi of a variational step; then `residual` (n_z) and `end` are functions
// of variables z and parameters (x, t, h, u, p).  Both ends are x'.
#pragma once

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/interface/system/system.h>

namespace dyntape {

struct RecordedStep {
  int nx = 0, nt = 0, n_z = 0;  // no unknowns: explicit
  Function residual, end;
};
RecordedStep record_step(const System& system, Integrator integrator);

// The Jacobians of a step, cut where the scheme meets the dynamics (step_scheme.h): at n_points points (t, q, v, drive).
// Derived as one function, those of a step of four stages would go through the dynamics' derivatives ten times.
//   points     where they are, of parameters (x, t, h, u, p, z):  rows (t, q, v, drive)
//   dynamics   of variables (dq, v, drive, p) and parameters (t, q), at dq = 0:  values (n_dynamics), then their Jacobian
//   chain      of variables (values at all points, z, dx, u) and parameters (x, t, h, q of all points, x'), at dx = 0:
//              non-zeros of the Jacobian of rows (dq, dv, d drive of each point, residual, dx')
// Increments are bound to zero after derivation, so that what moves the state costs nothing where it stands still.  Of a
// variational step z is (xi, v'), and the momentum at the end one more residual.
struct RecordedJacobians {
  int n_points = 0, n_dynamics = 0, n_z = 0;
  Function points, dynamics, chain;
  Pattern of_dynamics, of_chain;
};
RecordedJacobians record_jacobians(const System& system, Integrator integrator);

// Of an entry of (x, t, h, u, p), for sentences: q.<joint>, v.<joint>, with an index where a joint has several; m[<motor>],
// t, h, u[<motor>], p[<parameter>].
std::string argument_name(const System& system, int entry);

}  // namespace dyntape
