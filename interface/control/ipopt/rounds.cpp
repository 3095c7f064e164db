// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/ipopt/rounds.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/nlp/status.h>
#include <dyntape/interface/control/riccati/second_order.h>

namespace dyntape {

namespace {

// Magnitudes that have shrunk by more are those of the start alone: of the objective, and of a variable, of which
// the tolerance still leaves five digits.
constexpr double kCoarseObjective = 16, kCoarseVariable = 1024;
constexpr int kMostRounds = 4;

// `before`: iterations of earlier rounds.
NlpSolution solve_in(const NlpScaling& units, Nlp& problem, const std::vector<double>& start,
                     SolverOptions options, const RoundSolver& solve, int before = 0,
                     const NlpSolution* warm = nullptr) {
  ScaledNlp scaled(problem, units);
  if (options.watch) {
    options.watch = [watch = options.watch, unit = scaled.units().objective, before](IterationRecord record) {
      record.objective *= unit;
      record.iteration += before;
      watch(record);
    };
  }
  const std::optional<NlpSolution> scaled_warm =
      warm ? std::optional(scaled.in_scaled_units(*warm)) : std::nullopt;
  NlpSolution solution = scaled.in_own_units(
      solve(scaled, scaled.in_scaled_units(start), options, scaled_warm ? &*scaled_warm : nullptr));
  solution.units = scaled.units();
  return solution;
}

bool optimal(const NlpSolution& solution) {
  return solution.status == SolveStatus::kSolved || solution.status == SolveStatus::kAcceptable;
}

// Whether it ended at a point to go on from.
bool usable(const NlpSolution& solution) {
  return optimal(solution) || solution.status == SolveStatus::kSettled;
}

// Whether the caller's limits ended it.
bool is_over(SolveStatus status) {
  return status == SolveStatus::kStopped || status == SolveStatus::kTimeLimit ||
         status == SolveStatus::kIterationLimit;
}

// Whether a tolerance in `units` is too coarse where nominal values are `found`.
bool coarse(const NlpScaling& units, const NlpScaling& found) {
  bool result = kCoarseObjective * found.objective < units.objective;
  for (std::size_t i = 0; i < found.x.size(); ++i) result |= kCoarseVariable * found.x[i] < units.x[i];
  return result;
}

SolveTimes operator+(SolveTimes a, const SolveTimes& b) { return a += b; }

NlpSolution solve_first(Nlp& problem, const std::vector<double>& start, const SolverOptions& options,
                        const RoundSolver& solve, int before) {
  try {
    NlpSolution solution =
        solve_in(problem.scaling(start), problem, start, options, solve, before, options.warm.get());
    if (solution.status == SolveStatus::kNotFinite && solution.iterations() == 0) problem.check_finite(start);
    return solution;
  } catch (const NumericalError&) {
    problem.check_finite(start);  // who can say where it is not finite says it
    throw;
  }
}

// Rounds from one start, which is `name`: one attempt.
NlpSolution solve_from(Nlp& problem, const std::string& name, const std::vector<double>& start,
                       const SolverOptions& options, const RoundSolver& solve, int before = 0) {
  NlpSolution solution = solve_first(problem, start, options, solve, before);
  for (int round = 1; round < kMostRounds && optimal(solution); ++round) {
    const NlpScaling found = problem.scaling(solution.x, solution.units);
    if (!coarse(solution.units, found)) break;
    const NlpSolution last = solution;
    const auto again = [&](const NlpSolution* warm) {
      NlpSolution next = solve_in(found, problem, last.x, less(options, solution), solve,
                                  before + solution.iterations(), warm);
      solution = joined(std::move(solution), std::move(next));
    };
    again(&last);
    if (is_stuck(solution.status)) again(nullptr);
    // In units of what is noise no row can be met: the last round's solution is one to the tolerance in its own units.
    if (last.status == SolveStatus::kSolved && solution.status != SolveStatus::kSolved &&
        !is_over(solution.status)) {
      NlpSolution spent = std::exchange(solution, last);
      solution.log = std::move(spent.log), solution.times = spent.times;
      break;
    }
  }
  solution.method = options.method;
  solution.attempts = {{options.method, name, solution.iterations(), solution.status, solution.objective}};
  return solution;
}

std::vector<double> within_bounds(const NlpShape& shape, std::vector<double> x) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(x[i], shape.x_lower[i], shape.x_upper[i]);
  return x;
}

void check_warm(const NlpShape& shape, const NlpSolution& warm) {
  if (warm.x.size() == shape.n() && warm.lambda.size() == shape.m()) return;
  throw ArgumentError("the earlier solution has " + std::to_string(warm.x.size()) + " variables and " +
                      std::to_string(warm.lambda.size()) + " rows, the program has " +
                      std::to_string(shape.n()) + " and " + std::to_string(shape.m()));
}

// Lengths along a direction of negative curvature whose largest entry is one nominal value: near the point the nearest
// optimum is found, farther away perhaps a better one.  If the first one lies beyond the second start, that is left out.
constexpr double kLengths[] = {0.05, 0.5};
constexpr int kMostSaddles = 5, kMostOfOne = 500;  // iterations from one length
constexpr double kLower = 1e-9;                    // of the objective: lower beyond rounding

bool is_lower(const NlpSolution& next, const NlpSolution& before) {
  const double size = std::max(std::abs(before.objective), before.units.objective);
  return usable(next) && next.objective < before.objective - kLower * size;
}

// Whether a solution lies at least so far from another one along a direction, in nominal values.
bool is_beyond(const NlpSolution& next, const NlpSolution& from, const std::vector<double>& direction,
               double length) {
  double along = 0, square = 0;
  for (std::size_t i = 0; i < direction.size(); ++i) {
    along += (next.x[i] - from.x[i]) / from.units.x[i] * direction[i];
    square += direction[i] * direction[i];
  }
  return along / square * std::copysign(1.0, length) >= std::abs(length);
}

// Away from a stationary point that is no minimum, along a direction of negative curvature and, where nothing better is
// there, against it: the best that is found, or `saddle` itself, with the iterations and times of all.
NlpSolution leave(Nlp& problem, const NlpSolution& saddle, const std::vector<double>& direction,
                  const SolverOptions& options, const RoundSolver& solve) {
  const NlpShape& shape = problem.shape();
  const std::string name = optimal(saddle) ? "beside a saddle point" : "beside a point of least violation";
  NlpSolution best = saddle, spent = saddle;
  for (const double sign : {1, -1}) {
    for (const double length : kLengths) {
      SolverOptions left = less(options, spent);
      left.max_iterations = std::min(left.max_iterations, kMostOfOne);
      if (left.max_iterations == 0 || options.stop.stop_requested()) break;
      std::vector<double> start = saddle.x;
      for (std::size_t i = 0; i < start.size(); ++i)
        start[i] += sign * length * direction[i] * saddle.units.x[i];
      start = within_bounds(shape, std::move(start));
      try {
        NlpSolution next = solve_from(problem, name, start, left, solve, spent.iterations());
        if (usable(best) ? is_lower(next, best) : usable(next)) best = next;
        const bool is_past = usable(next) && is_beyond(next, saddle, direction, sign * kLengths[1]);
        spent = joined(std::move(spent), std::move(next));
        if (is_past) break;
      } catch (const NumericalError&) {  // no finite value there
      }
    }
    if (usable(best) && (!optimal(saddle) || best.objective < saddle.objective)) break;
  }
  best.log = std::move(spent.log), best.times = spent.times, best.attempts = std::move(spent.attempts);
  return best;
}

}  // namespace

SolverOptions less(SolverOptions options, const NlpSolution& spent) {
  options.max_iterations = std::max(options.max_iterations - spent.iterations(), 0);
  options.max_seconds = seconds_left(options, spent.times.processor);
  return options;
}

NlpSolution joined(NlpSolution first, NlpSolution last) {
  const int before = first.iterations();
  for (IterationRecord record : last.log) {
    record.iteration += before;
    if (record.iteration > before) first.log.push_back(record);
  }
  last.log = std::move(first.log);
  first.attempts.insert(first.attempts.end(), last.attempts.begin(), last.attempts.end());
  last.attempts = std::move(first.attempts);
  last.times = first.times + last.times;
  return last;
}

NlpSolution solve_in_rounds(Nlp& problem, const std::vector<double>& start, const SolverOptions& given,
                            const RoundSolver& solve) {
  SolverOptions options = given;
  const std::shared_ptr<const NlpSolution> warm = std::exchange(options.warm, nullptr);
  NlpSolution solution;
  if (warm) {
    check_warm(problem.shape(), *warm);
    solution =
        solve_from(problem, "an earlier solution", within_bounds(problem.shape(), warm->x), given, solve);
  }
  if (!warm || !usable(solution)) {
    NlpSolution cold = solve_from(problem, "the guess", start, warm ? less(options, solution) : options,
                                  solve, solution.iterations());
    solution = warm ? joined(std::move(solution), std::move(cold)) : std::move(cold);
  }
  if (solution.status == SolveStatus::kLocallyInfeasible) {
    ScaledNlp scaled(problem, solution.units);
    const CurvatureCheck check = check_violation(scaled, scaled.in_scaled_units(solution.x));
    if (check.order == StationaryPoint::kNotMinimum)
      solution = leave(problem, solution, check.direction, options, solve);
  }
  for (int saddle = 0; optimal(solution); ++saddle) {
    ScaledNlp scaled(problem, solution.units);
    CurvatureCheck check = check_second_order(scaled, scaled.in_scaled_units(solution));
    if (check.order == StationaryPoint::kMinimum && !check.flat.empty()) {
      check.direction = falls_along(scaled, scaled.in_scaled_units(solution), check.flat);
      if (!check.direction.empty()) check.order = StationaryPoint::kNotMinimum;
    }
    solution.stationary_point = check.order;
    if (check.order != StationaryPoint::kNotMinimum || saddle == kMostSaddles) break;
    const double before = solution.objective;
    solution = leave(problem, solution, check.direction, options, solve);
    if (!(solution.objective < before)) break;
  }
  return solution;
}

}  // namespace dyntape
