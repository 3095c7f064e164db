// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/ipopt/ipopt.h>
#include <dyntape/interface/control/ipopt/rounds.h>
#include <dyntape/interface/control/nlp/lifted_nlp.h>
#include <dyntape/interface/control/riccati/interior_point.h>

namespace dyntape {

NlpSolution solve_with_riccati(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  if (start.size() != problem.shape().n())
    throw ArgumentError("solve_with_riccati: the start has " + std::to_string(start.size()) +
                        " entries, the problem has " + std::to_string(problem.shape().n()) + " variables");
  SolverOptions of_method = options;
  of_method.method = NlpMethod::kRiccati;
  return solve_in_rounds(problem, start, of_method,
                         [](Nlp& scaled, const std::vector<double>& from, const SolverOptions& of_round,
                            const NlpSolution* warm) {
                           if (!LiftedNlp::is_needed(scaled.shape()))
                             return StructuredInteriorPoint(scaled).solve(from, of_round, warm);
                           LiftedNlp carried(scaled, from);
                           return carried.in_own_variables(
                               StructuredInteriorPoint(carried).solve(carried.start(from), of_round));
                         });
}

namespace {

// A start beside the given one: every variable of a stage to one side by half its nominal value, its neighbours to the other,
// most in the middle of the chain.  A straight line through an obstacle becomes a way around it.
std::vector<double> bent(const Nlp& problem, std::vector<double> x, const NlpScaling& units) {
  const NlpShape& shape = problem.shape();
  const std::size_t stages = std::max<std::size_t>(shape.stages.size(), 1);
  for (std::size_t k = 0; k < stages; ++k) {
    const std::size_t begin = shape.stages.empty() ? 0 : shape.stages[k];
    const std::size_t end = k + 1 < stages ? shape.stages[k + 1] : shape.n();
    const double size = 0.5 * std::sin(std::numbers::pi * (double(k) + 0.5) / double(stages));
    for (std::size_t i = begin; i < end; ++i) {
      const double unit = units.x.empty() ? 1 : units.x[i];
      x[i] =
          std::clamp(x[i] + ((i - begin) % 2 == 0 ? size : -size) * unit, shape.x_lower[i], shape.x_upper[i]);
    }
  }
  return x;
}

NlpMethod method_for(const NlpShape& shape, const SolverOptions& options) {
  if (options.method != NlpMethod::kAutomatic) return options.method;
  const bool needs_ipopt = options.limited_memory || shape.hessian_kind == HessianKind::kLimitedMemory ||
                           !options.extra.empty() || options.print_level > 0 || shape.stages.empty();
  return needs_ipopt ? NlpMethod::kIpopt : NlpMethod::kRiccati;
}

NlpSolution solve_by(NlpMethod method, Nlp& problem, const std::vector<double>& start,
                     const SolverOptions& options) {
  return (method == NlpMethod::kIpopt ? solve_with_ipopt : solve_with_riccati)(problem, start, options);
}

}  // namespace

NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  const NlpMethod first = method_for(problem.shape(), options);
  NlpSolution solution = solve_by(first, problem, start, options);
  const bool is_stalled = solution.status == SolveStatus::kAcceptable;
  if ((!is_stuck(solution.status) && !is_stalled) || !options.try_other_method) return solution;
  if (options.limited_memory || problem.shape().hessian_kind == HessianKind::kLimitedMemory) return solution;
  const NlpMethod other = first == NlpMethod::kIpopt ? NlpMethod::kRiccati : NlpMethod::kIpopt;
  // Whether it is solved; iterations and times count in any case.
  const auto try_by = [&](NlpMethod method, const std::vector<double>& from, const std::string& name,
                          std::shared_ptr<const NlpSolution> warm = nullptr) {
    SolverOptions of_method = less(options, solution);
    of_method.warm = std::move(warm);
    of_method.first_barrier = 0;
    if (method != first) of_method.extra.clear();
    if (of_method.max_iterations == 0 || options.stop.stop_requested()) return false;
    try {
      NlpSolution found = solve_by(method, problem, from, of_method);
      const bool is_solved = found.status == SolveStatus::kSolved;
      found.attempts.front().start = name;
      NlpSolution both = joined(solution, std::move(found));
      both.is_by_other_method = method != first;
      if (is_solved) return solution = std::move(both), true;
      solution.log = std::move(both.log), solution.times = both.times;
      solution.attempts = std::move(both.attempts);
    } catch (const ArgumentError&) {   // a program that the other method does not know
    } catch (const NumericalError&) {  // or whose functions are not finite where it begins
    }
    return false;
  };
  if (is_stalled) {  // the other method goes on from there
    const auto stalled = std::make_shared<NlpSolution>(solution);
    try_by(other, stalled->x, "where the first method ended", stalled);
    return solution;
  }
  if (!try_by(other, start, "the guess") && solution.status == SolveStatus::kLocallyInfeasible)
    try_by(first, bent(problem, start, solution.units), "the guess, bent to one side");
  return solution;
}

}  // namespace dyntape
