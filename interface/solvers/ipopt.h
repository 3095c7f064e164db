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
// What Ipopt sees is divided by the program's magnitudes (Nlp::magnitudes): its tolerances, and the
// infeasibilities in its log, are in those units; the solution is in the program's own.
//
// Rounds.  A wild start makes magnitudes, and with them the tolerances, many times too large.  Where those at the
// optimum that is found are smaller, the solve goes on from there in these, up to three times more; limits of
// iterations and time hold for all rounds together.
//
// Stopping.  The best point of a solve that was stopped is the one that violates the constraints least; of those that
// violate them by less than 1e-6 of their magnitudes, the one of the least cost.  Multipliers are the last ones.
//
// Threads.  Ipopt's linear solver keeps static state, so one solve runs at a time in a process: calls from other
// threads wait for their turn, which counts neither as time of the solve nor against max_seconds.  The problem's
// functions must not solve again, in their thread or in one that they wait for.
//
// Errors.  ArgumentError: start of the wrong size, an option that Ipopt or this program refuses, a solve within
// a solve.  NumericalError: the functions are not finite at the start (ahead of any iteration).  What the
// problem's functions throw comes through.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/solvers/nlp.h>
#include <dyntape/interface/solvers/status.h>

namespace dyntape {

// One line of Ipopt's log.
struct IterationRecord {
  int iteration;
  double objective, primal_infeasibility, dual_infeasibility;
  double barrier, step_norm, regularization, dual_step, primal_step;
  int line_search_trials;
  bool restoration;
};

struct IpoptOptions {
  double tolerance = 1e-8;         // of the scaled optimality error
  double dual_tolerance = 1;       // of the stationarity alone, without the weights of the error above
  double bound_relaxation = 1e-8;  // relative widening of bounds before the solve; 0 keeps them exact
  bool limited_memory = false;     // approximate the Hessian (L-BFGS) even where the program has one
  bool stop_at_acceptable = true;  // give up early when stalled at an acceptable point (kAcceptable)
  int max_iterations = 3000;
  double max_seconds = 1e6;  // of processor time, of all threads together
  int print_level = 0;       // 0 silent .. 5 one line an iteration .. 12
  // Options by Ipopt's name, numbers in full and in any locale ("1e-3", but "1000" where it is a whole one).
  // Refused are options that name files or libraries, that print, and that start from multipliers.
  std::vector<std::pair<std::string, std::string>> extra = {};
  // A request ends the solve with the iteration: kStopped, and the best point so far (below).
  std::stop_token stop = {};
  std::function<void(const IterationRecord&)> watch =
      {};  // told of each iteration, in the program's own units
};

// Seconds of wall time (`processor`: of all threads together), and how often each was asked for.
struct SolveTimes {
  double total = 0, processor = 0, functions = 0, jacobian = 0, hessian = 0;
  int function_calls = 0, jacobian_calls = 0, hessian_calls = 0;
  double solver() const { return total - functions - jacobian - hessian; }  // linear algebra and the rest
};

struct NlpSolution {
  SolveStatus status = SolveStatus::kSolverError;
  int native_status = 0;  // Ipopt's ApplicationReturnStatus
  double objective = 0;
  std::vector<double> x;                         // (n)
  std::vector<double> g, lambda;                 // (m): lambda > 0 pulls g down to its upper bound
  std::vector<double> lower_price, upper_price;  // (n): >= 0, multipliers of x_lower and x_upper
  std::vector<IterationRecord> log;              // iteration 0 is the start
  NlpMagnitudes units;                           // what was divided by in the last round
  SolveTimes times;

  int iterations() const { return log.empty() ? 0 : log.back().iteration; }
};

NlpSolution solve_with_ipopt(Nlp& problem, const std::vector<double>& start,
                             const IpoptOptions& options = {});

}  // namespace dyntape
