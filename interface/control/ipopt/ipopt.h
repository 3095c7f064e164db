// SPDX-License-Identifier: BSD-3-Clause
//
// Solves a nonlinear program with Ipopt.
//
//   NlpSolution s = solve_with_ipopt(problem, start, {.tolerance = 1e-10, .print_level = 5});
//   if (s.status == SolveStatus::kSolved) use(s.x, s.objective);
//
// To compute an optimum to twelve digits, set tolerance 1e-12, dual_tolerance 1e-10 and bound_relaxation 0.  The
// defaults leave an error of about 1e-9 in the cost, from relaxed bounds and the tolerance.
//
// Units.  Ipopt sees the program divided by its nominal values (Nlp::scaling).  Tolerances and the infeasibilities
// in Ipopt's log are in these units; the solution is in the program's units.
//
// Rounds.  A poor start makes nominal values, and thus tolerances, much too large.  If the nominal values at the
// optimum are smaller, the solve continues with them, including multipliers, up to three times.  Limits of
// iterations and time hold for all rounds together.
//
// Stopping.  A stop request ends the solve after the current iteration, but at most after a tenth of a second.
//
// - The result is the point with the least constraint violation; among points below 1e-6 of the nominal values, the
// one with the least cost.
// - Multipliers are the last ones; there are none from an unfinished iteration.
// - The linear solver may finish its work in a separate thread, which no longer calls the program.  The next solve
// and the end of the process wait for it (std::_Exit does not).
//
// Threads.  Ipopt's linear solver has static state, so a process runs one solve at a time.  Calls from other threads
// wait; this time does not count as solve time or against max_seconds.  The program's functions must not start a
// solve, in their thread or in one that they wait for.  If a stop token is given, the functions are called from
// another thread while the caller waits.
//
// Errors.  Exceptions of the program's functions are passed on.  ArgumentError: a start of wrong size, an invalid
// option, a solve within a solve.  NumericalError: functions that are not finite at the start.
//
// Source: A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search algorithm
// for large-scale nonlinear programming", Mathematical Programming 106(1), 2006.
#pragma once

#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

NlpSolution solve_with_ipopt(Nlp& problem, const std::vector<double>& start,
                             const SolverOptions& options = {});

}  // namespace dyntape
