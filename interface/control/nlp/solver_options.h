// SPDX-License-Identifier: BSD-3-Clause
//
// What a nonlinear program is solved by, and to what end.
//
//   const NlpSolution s = solve_nlp(problem, start, {.method = NlpMethod::kRiccati, .tolerance = 1e-10});
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

// How the structured interior point chooses the barrier parameter of a step.
enum class BarrierUpdate {
  kAdaptive,  // anew at each step while the error falls (barrier_parameter.h)
  kMonotone,  // lowered when the barrier problem is solved; steadier where rows depend on each other, as in complementarity
};

struct SolverOptions {
  NlpMethod method = NlpMethod::kIpopt;
  double tolerance = 1e-8;         // of the scaled optimality error
  double dual_tolerance = 1;       // of the stationarity alone, without the weights of the error above
  double bound_relaxation = 1e-8;  // relative widening of bounds before the solve; 0 keeps them exact
  BarrierUpdate barrier_update = BarrierUpdate::kAdaptive;  // of kRiccati; Ipopt's is its own "mu_strategy"
  bool limited_memory = false;     // approximate the Hessian (L-BFGS) even where the program has one
  bool stop_at_acceptable = true;  // give up early when stalled at an acceptable point (kAcceptable)
  bool stop_when_settled = false;  // early, for meshes that will be refined: kSettled (settling.h)
  bool try_other_method =
      true;  // of solve_nlp: where the method gets stuck, the other one tries from the same start
  // A solution of a program with the same variables and rows, whose point and multipliers the solve begins with; `start` is not
  // read then.  Bounds may have moved: 3 iterations from the solution itself, some 6 where a goal has moved by a hundredth.
  std::shared_ptr<const NlpSolution> warm = {};
  int max_iterations = 3000;
  double max_seconds = 1e6;  // of processor time, of all threads together
  int print_level = 0;       // of Ipopt: 0 silent .. 5 one line an iteration .. 12
  // Options by Ipopt's name, numbers in full and in any locale ("1e-3", but "1000" where it is a whole one).
  // Refused are options that name files or libraries, that print, and that start from multipliers.
  std::vector<std::pair<std::string, std::string>> extra = {};
  // A request ends the solve: kStopped, and the best point so far (ipopt.h).
  std::stop_token stop = {};
  std::function<void(const IterationRecord&)> watch =
      {};  // told of each iteration, in the program's own units
};

// By either; their headers say what they refuse.
NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options = {});

}  // namespace dyntape
