// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/solvers/carried_nlp.h>
#include <dyntape/interface/solvers/interior_point.h>
#include <dyntape/interface/solvers/ipopt.h>
#include <dyntape/interface/solvers/rounds.h>

namespace dyntape {

NlpSolution solve_by_stages(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  if (start.size() != problem.shape().n())
    throw ArgumentError("solve_by_stages: the start has " + std::to_string(start.size()) +
                        " entries, the problem has " + std::to_string(problem.shape().n()) + " variables");
  return solve_in_rounds(
      problem, start, options,
      [](Nlp& scaled, const std::vector<double>& from, const SolverOptions& of_round) {
        if (!CarriedNlp::is_needed(scaled.shape())) return StageSolver(scaled).solve(from, of_round);
        CarriedNlp carried(scaled, from);
        return carried.in_own_variables(StageSolver(carried).solve(carried.start(from), of_round));
      });
}

NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  const auto solve = options.method == NlpMethod::kIpopt ? solve_with_ipopt : solve_by_stages;
  return solve(problem, start, options);
}

}  // namespace dyntape
