// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/solvers/interior_point.h>
#include <dyntape/interface/solvers/ipopt.h>
#include <dyntape/interface/solvers/rounds.h>

namespace dyntape {

NlpSolution solve_by_stages(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  const NlpShape& shape = problem.shape();
  if (start.size() != shape.n())
    throw ArgumentError("solve_by_stages: the start has " + std::to_string(start.size()) +
                        " entries, the problem has " + std::to_string(shape.n()) + " variables");
  if (options.limited_memory)
    throw ArgumentError(
        "solve_by_stages: limited memory is an option of Ipopt's, which this solver does not have");
  const auto refuse = [](const std::string& what) { throw ArgumentError("solve_by_stages: " + what); };
  const std::pair<const char*, double> positive[] = {{"tolerance", options.tolerance},
                                                     {"dual tolerance", options.dual_tolerance},
                                                     {"limit of time", options.max_seconds}};
  for (const auto& [name, value] : positive) {
    if (!(value > 0))
      refuse("the " + std::string(name) + " is " + io::shortest(value) + ", expected a number above 0");
  }
  if (!(options.bound_relaxation >= 0))
    refuse("the bound relaxation is " + io::shortest(options.bound_relaxation) +
           ", expected a number from 0");
  if (options.max_iterations < 0)
    refuse("at most " + std::to_string(options.max_iterations) + " iterations, expected 0 or more");
  if (!options.extra.empty())
    throw ArgumentError("solve_by_stages: \"" + options.extra.front().first +
                        "\" is an option of Ipopt's, which this solver does not have");
  return solve_in_rounds(problem, start, options,
                         [](Nlp& scaled, const std::vector<double>& from, const SolverOptions& of_round) {
                           return StageSolver(scaled).solve(from, of_round);
                         });
}

NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  const auto solve = options.method == NlpMethod::kIpopt ? solve_with_ipopt : solve_by_stages;
  return solve(problem, start, options);
}

}  // namespace dyntape
