// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/solvers/rounds.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <dyntape/interface/solvers/scaled_nlp.h>
#include <dyntape/interface/solvers/second_order.h>

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

// Rounds from one start.
NlpSolution solve_from(Nlp& problem, const std::vector<double>& start, const SolverOptions& options,
                       const RoundSolver& solve, int before = 0) {
  const auto first = [&] {
    try {
      NlpSolution solution = solve_in(problem.magnitudes(start), problem, start, options, solve, before);
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
    NlpSolution next =
        solve_in(found, problem, again, less(options, solution), solve, before + solution.iterations());
    solution = joined(std::move(solution), std::move(next));
  }
  return solution;
}

// Lengths along a direction of negative curvature whose largest entry is one nominal value: near the point the nearest
// optimum is found, farther away perhaps a better one.
using Lengths =
    std::vector<std::vector<double>>;  // the first group that has a better one is the last that is tried
const Lengths kBothWays = {{0.05, 0.5}, {-0.05, -0.5}}, kOnce = {{0.5}};
constexpr int kMostSaddles = 5;
constexpr double kLower = 1e-9;  // of the objective: lower beyond rounding

bool is_lower(const NlpSolution& next, const NlpSolution& before) {
  const double size = std::max(std::abs(before.objective), before.units.objective);
  return optimal(next) && next.objective < before.objective - kLower * size;
}

// Every variable of a stage to one side, its neighbours to the other, most in the middle of the chain.
std::vector<double> bump(const NlpShape& shape) {
  std::vector<double> direction(shape.n());
  const std::size_t stages = std::max<std::size_t>(shape.stages.size(), 1);
  for (std::size_t k = 0; k < stages; ++k) {
    const std::size_t begin = shape.stages.empty() ? 0 : shape.stages[k];
    const std::size_t end = k + 1 < stages ? shape.stages[k + 1] : shape.n();
    const double size = std::sin(std::numbers::pi * (double(k) + 0.5) / double(stages));
    for (std::size_t i = begin; i < end; ++i) direction[i] = (i - begin) % 2 == 0 ? size : -size;
  }
  return direction;
}

// From a place beside a stationary point: the best that is found at lengths along a direction, or `saddle` itself, with the
// iterations and times of all.
NlpSolution leave(Nlp& problem, const NlpSolution& saddle, const std::vector<double>& from,
                  const std::vector<double>& direction, const Lengths& groups, const SolverOptions& options,
                  const RoundSolver& solve) {
  const NlpShape& shape = problem.shape();
  NlpSolution best = saddle, spent = saddle;
  for (const std::vector<double>& lengths : groups) {
    for (const double length : lengths) {
      const SolverOptions left = less(options, spent);
      if (left.max_iterations == 0 || options.stop.stop_requested()) break;
      std::vector<double> start = from;
      for (std::size_t i = 0; i < start.size(); ++i) {
        start[i] = std::clamp(start[i] + length * direction[i] * saddle.units.x[i], shape.x_lower[i],
                              shape.x_upper[i]);
      }
      try {
        NlpSolution next = solve_from(problem, start, left, solve, spent.iterations());
        if (optimal(best) ? is_lower(next, best) : optimal(next)) best = next;
        spent = joined(std::move(spent), std::move(next));
      } catch (const NumericalError&) {  // no finite value there
      }
    }
    if (optimal(best) && (!optimal(saddle) || best.objective < saddle.objective)) break;
  }
  best.log = std::move(spent.log), best.times = spent.times;
  return best;
}

}  // namespace

NlpSolution solve_in_rounds(Nlp& problem, const std::vector<double>& start, const SolverOptions& options,
                            const RoundSolver& solve) {
  NlpSolution solution = solve_from(problem, start, options, solve);
  if (solution.status == SolveStatus::kLocallyInfeasible) {
    ScaledNlp scaled(problem, solution.units);
    const CurvatureCheck check = check_violation(scaled, scaled.in_scaled_units(solution.x));
    const bool is_saddle = check.order == StationaryPoint::kNotMinimum;
    // From a minimum of the violation nothing leads on; another start may lead to another point, and one is tried.
    solution = is_saddle ? leave(problem, solution, solution.x, check.direction, kBothWays, options, solve)
                         : leave(problem, solution, start, bump(problem.shape()), kOnce, options, solve);
  }
  for (int saddle = 0; optimal(solution); ++saddle) {
    ScaledNlp scaled(problem, solution.units);
    const CurvatureCheck check = check_second_order(scaled, scaled.in_scaled_units(solution));
    solution.stationary_point = check.order;
    if (check.order != StationaryPoint::kNotMinimum || saddle == kMostSaddles) break;
    const double before = solution.objective;
    solution = leave(problem, solution, solution.x, check.direction, kBothWays, options, solve);
    if (!(solution.objective < before)) break;
  }
  return solution;
}

}  // namespace dyntape
