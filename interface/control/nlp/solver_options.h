// SPDX-License-Identifier: BSD-3-Clause
//
// Options of the solvers of nonlinear programs.
//
//   const NlpSolution s = solve_nlp(problem, start, {.method = NlpMethod::kRiccati, .tolerance = 1e-10});
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

// How the structured interior-point method updates the barrier parameter.
enum class BarrierUpdate {
  kAdaptive,  // at each step while the error decreases (barrier_parameter.h)
  kMonotone,  // when the barrier problem is solved; more robust for dependent rows, e.g. complementarity
};

struct SolverOptions {
  NlpMethod method = NlpMethod::kAutomatic;
  double tolerance = 1e-8;         // for the scaled optimality error
  double dual_tolerance = 1;       // for the stationarity alone, without the weights of the error above
  double bound_relaxation = 1e-8;  // relative widening of bounds before the solve; 0 keeps them exact
  BarrierUpdate barrier_update =
      BarrierUpdate::kAdaptive;    // for kRiccati; Ipopt has its option "mu_strategy"
  bool limited_memory = false;     // approximate the Hessian (L-BFGS) even if the program has one
  bool stop_at_acceptable = true;  // stop early if stalled at an acceptable point (kAcceptable)
  bool stop_when_settled = false;  // stop early on meshes that will be refined: kSettled (settling.h)
  bool try_other_method = true;    // solve_nlp: if the method fails, the other one starts from the same point
  // A solution of a program with the same variables and rows.  The solve starts from its point and multipliers, and
  // ignores `start`.  Bounds may differ: 3 iterations if no bound changed, about 6 if a goal moved by a
  // hundredth.  If multipliers of equations are NaN (with_multipliers_of()), kRiccati estimates them.
  std::shared_ptr<const NlpSolution> warm = {};
  // The first barrier parameter, of the scaled program, for a start near a solution whose multipliers are unknown.
  // The start is moved inside the bounds in proportion to its violation of the rows, by 1e-2 at most.
  // 0: the method's own first barrier.  Ignored with `warm`.
  double first_barrier = 0;
  int max_iterations = 3000;
  double max_seconds = 1e6;  // of processor time, all threads together
  int print_level = 0;       // of Ipopt: 0 silent .. 5 one line per iteration .. 12
  // Options by Ipopt's name; numbers in any notation and locale ("1e-3"; "1000" for an integer option).  Options that
  // name files or libraries, that print, or that start from multipliers are refused.
  std::vector<std::pair<std::string, std::string>> extra = {};
  // A request ends the solve with kStopped and the best point so far (ipopt.h).
  std::stop_token stop = {};
  std::function<void(const IterationRecord&)> watch =
      {};  // called at each iteration, with values in the program's units
};

// Returns max_seconds - spent, at least 1e-9 s, since the solvers require a positive limit.
inline double seconds_left(const SolverOptions& options, double spent) {
  constexpr double kLeast = 1e-9;
  return std::max(options.max_seconds - spent, kLeast);
}

// Solves by the chosen method; the methods' headers list their errors.
NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options = {});

}  // namespace dyntape
