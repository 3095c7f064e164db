// SPDX-License-Identifier: BSD-3-Clause
//
// Ipopt as the solver of an Nlp.
//
//   NlpSolution s = solve_with_ipopt(problem, start, {.tolerance = 1e-10, .print_level = 5});
//   if (s.status == SolveStatus::kSolved) use(s.x, s.objective);
//
// Method: A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search
// algorithm for large-scale nonlinear programming", Mathematical Programming 106(1), 2006.
//
// To see twelve digits of an optimum: tolerance 1e-12, dual_tolerance 1e-10, bound_relaxation 0.  With the
// defaults, relaxed bounds and the tolerance leave an error of about 1e-9 in the cost.
//
// What Ipopt sees is divided by the program's nominal values (Nlp::scaling): its tolerances, and the
// infeasibilities in its log, are in those units; the solution is in the program's own.
//
// Rounds.  A wild start makes nominal values, and with them the tolerances, many times too large.  Where those at the
// optimum that is found are smaller, the solve goes on from there in these, its multipliers included, up to three times more;
// limits of iterations and time hold for all rounds together.
//
// Stopping.  A request ends the solve with the iteration or, where that takes longer, after a tenth of a second.  The
// best point of a solve that was stopped is the one that violates the constraints least; of those that violate them by
// less than 1e-6 of their nominal values, the one of the least cost.  Multipliers are the last ones; of an iteration that was
// not waited for there are none.  What the linear solver then still computes, it computes in a thread of its own, which
// asks nothing of the program any more: the next solve, and the end of the process, wait for it (std::_Exit does not).
//
// Threads.  Ipopt's linear solver keeps static state, so one solve runs at a time in a process: calls from other
// threads wait for their turn, which counts neither as time of the solve nor against max_seconds.  The problem's
// functions must not solve again, in their thread or in one that they wait for.  A solve that can be stopped calls them
// from another thread than the caller's, which waits meanwhile.
//
// Errors.  ArgumentError: start of the wrong size, an option that Ipopt or this program refuses, a solve within
// a solve.  NumericalError: the functions are not finite at the start (ahead of any iteration).  What the
// problem's functions throw comes through.
#pragma once

#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

NlpSolution solve_with_ipopt(Nlp& problem, const std::vector<double>& start,
                             const SolverOptions& options = {});

}  // namespace dyntape
