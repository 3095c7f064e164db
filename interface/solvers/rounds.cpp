// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/solvers/rounds.h>

#include <algorithm>

#include <dyntape/interface/solvers/scaled_nlp.h>

namespace dyntape {

namespace {

// Magnitudes that have shrunk by more are those of the start alone: of the objective, and of a variable, of which
// the tolerance still leaves five digits.
constexpr double kCoarseObjective = 16, kCoarseVariable = 1024;
constexpr int kMostRounds = 4;
constexpr double kLeastSeconds = 1e-6;  // Ipopt refuses to be given none

// `before`: iterations of earlier rounds.
NlpSolution solve_in(const NlpMagnitudes& units, Nlp& problem, const std::vector<double>& start,
                     SolverOptions options, const RoundSolver& solve, int before = 0) {
  ScaledNlp scaled(problem, units);
  if (options.watch) {
    options.watch = [watch = options.watch, unit = scaled.units().objective, before](IterationRecord record) {
      record.objective *= unit;
      record.iteration += before;
      watch(record);
    };
  }
  NlpSolution solution = scaled.in_own_units(solve(scaled, scaled.in_scaled_units(start), options));
  solution.units = scaled.units();
  return solution;
}

bool optimal(const NlpSolution& solution) {
  return solution.status == SolveStatus::kSolved || solution.status == SolveStatus::kAcceptable;
}

// Whether a tolerance in `units` is too coarse where magnitudes are `found`.
bool coarse(const NlpMagnitudes& units, const NlpMagnitudes& found) {
  bool result = kCoarseObjective * found.objective < units.objective;
  for (std::size_t i = 0; i < found.x.size(); ++i) result |= kCoarseVariable * found.x[i] < units.x[i];
  return result;
}

SolverOptions less(SolverOptions options, const NlpSolution& spent) {
  options.max_iterations = std::max(options.max_iterations - spent.iterations(), 0);
  options.max_seconds = std::max(options.max_seconds - spent.times.processor, kLeastSeconds);
  return options;
}

SolveTimes operator+(const SolveTimes& a, const SolveTimes& b) {
  return {a.total + b.total,
          a.processor + b.processor,
          a.functions + b.functions,
          a.jacobian + b.jacobian,
          a.hessian + b.hessian,
          a.function_calls + b.function_calls,
          a.jacobian_calls + b.jacobian_calls,
          a.hessian_calls + b.hessian_calls};
}

// The last of two rounds, with the iterations and times of both.  It starts where the first ends.
NlpSolution joined(NlpSolution first, NlpSolution last) {
  const int before = first.iterations();
  for (IterationRecord record : last.log) {
    record.iteration += before;
    if (record.iteration > before) first.log.push_back(record);
  }
  last.log = std::move(first.log);
  last.times = first.times + last.times;
  return last;
}

}  // namespace

NlpSolution solve_in_rounds(Nlp& problem, const std::vector<double>& start, const SolverOptions& options,
                            const RoundSolver& solve) {
  const auto first = [&] {
    try {
      NlpSolution solution = solve_in(problem.magnitudes(start), problem, start, options, solve);
      if (solution.status == SolveStatus::kNotFinite && solution.iterations() == 0)
        problem.check_finite(start);
      return solution;
    } catch (const NumericalError&) {
      problem.check_finite(start);  // who can say where it is not finite says it
      throw;
    }
  };
  NlpSolution solution = first();
  for (int round = 1; round < kMostRounds && optimal(solution); ++round) {
    const NlpMagnitudes found = problem.magnitudes(solution.x, solution.units);
    if (!coarse(solution.units, found)) break;
    const std::vector<double> again = solution.x;
    NlpSolution next = solve_in(found, problem, again, less(options, solution), solve, solution.iterations());
    solution = joined(std::move(solution), std::move(next));
  }
  return solution;
}

}  // namespace dyntape
