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

namespace {

// Ended where it could not go on, which says more of the method than of the program.
bool is_stuck(SolveStatus status) {
  return status == SolveStatus::kLocallyInfeasible || status == SolveStatus::kRestorationFailed ||
         status == SolveStatus::kStepTooSmall || status == SolveStatus::kStepFailed;
}

NlpSolution solve_by(NlpMethod method, Nlp& problem, const std::vector<double>& start,
                     const SolverOptions& options) {
  return (method == NlpMethod::kIpopt ? solve_with_ipopt : solve_by_stages)(problem, start, options);
}

}  // namespace

NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  NlpSolution solution = solve_by(options.method, problem, start, options);
  if (!is_stuck(solution.status) || !options.try_other_method) return solution;
  SolverOptions left = less(options, solution);
  left.extra.clear();
  if (left.max_iterations == 0 || options.stop.stop_requested() || options.limited_memory ||
      problem.shape().hessian_kind == HessianKind::kLimitedMemory)
    return solution;
  const NlpMethod other = options.method == NlpMethod::kIpopt ? NlpMethod::kStages : NlpMethod::kIpopt;
  try {
    NlpSolution found = solve_by(other, problem, start, left);
    const bool is_solved = found.status == SolveStatus::kSolved;
    NlpSolution both = joined(solution, std::move(found));
    both.is_by_other_method = true;
    if (is_solved) return both;
    solution.log = std::move(both.log), solution.times = both.times;
  } catch (const ArgumentError&) {   // a program that the other method does not know
  } catch (const NumericalError&) {  // or whose functions are not finite where it begins
  }
  return solution;
}

}  // namespace dyntape
