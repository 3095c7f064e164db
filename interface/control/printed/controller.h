// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a model predictive controller as one C file and its header, for microcontrollers: C99 without heap, recursion,
// libraries or static variables.  Its state is one struct that the caller owns.
//
//   Problem p = ...;                                                    // its duration is the horizon (problem.h)
//   PrintedController c = generate_controller(p, {.mesh = {.scheme = runge_kutta_4(1), .intervals = 20}});
//   write_source(c.source, "generated");                                // generated/lift.c and .h (pipeline.h)
//
//   lift_state state;                                                   // in C
//   lift_init(&state);                                                  // the guess, bounds and parameters of the problem
//   for (;;) {
//     lift_status status = lift_step(&state, x, t, 2);                  // at most 2 iterations
//     lift_control(&state, t, x, u);                                    // at any rate: plan with feedback
//   }
//
// Method.  A step shifts the plan to the measured time, and does iterations of sequential quadratic programming until
// the plan is solved or the budget ends.  An iteration:
//
// - linearises all stages, with Gauss-Newton's Hessian
// - solves the quadratic program by at most `interior_steps` predictor-corrector steps of an interior-point method;
// their linear systems are Riccati recursions with constant sizes, without the zeros of the Jacobians
// - moves along the solution by the first of 1, 1/2, 1/4, ... that lowers a merit function
//
// Limits of controls always hold.  Limits of states, path rows, goals and rows at the end are soft: an excess of one
// nominal value costs `price` nominal costs, so that every quadratic program has a solution, and a plan violates a limit
// only if its multiplier exceeds the price.  If none does, the solution is that of RecedingHorizon
// (receding_horizon.h) on the same mesh.
//
// Time.  All loops have constant bounds.  The header states operations, loads, stores and turns of loops of a step: a
// fixed part, and a part of each iteration (text_count.h).
//
// Memory.  The header states the bytes of state, constants and stack.  `target_bytes` refuses a controller that is
// larger.
//
// Errors.  ArgumentError, naming the part:
//
// - free duration or start, accelerations as variables (the inverse form), terms at the start or between start and end
// - a scheme whose steps are not explicit (trapezoid, ...), an uneven mesh, Hessians other than Gauss-Newton
// - functions with branches that the recording fixed (guards), or that need a library (atan2, exp, ...)
// - equal limits of a control; end terms that read controls; an option out of its range; more than `target_bytes`
//
// Sources: S. Mehrotra, On the implementation of a primal-dual interior point method, SIAM Journal on Optimization 2(4),
// 1992; C. V. Rao, S. J. Wright, J. B. Rawlings, Application of interior-point methods to model predictive control,
// JOTA 99(3), 1998; M. Diehl et al., A real-time iteration scheme (receding_horizon.h).
#pragma once

#include <dyntape/interface/control/printed/printed_controller.h>

namespace dyntape {

PrintedController generate_controller(const Problem& problem, const ControllerOptions& options = {});

}  // namespace dyntape
