// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

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

// Iterations after which a solve from a guess pauses and other starts are tried.  The longest solve of a mesh of the
// shipped tasks takes 405 (quadruped_stands_up by riccati); from a guess that is symmetric about an obstacle none ends.
constexpr int kIterationsBeforeOthers = 500;

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

// Solves by the first method and, if that gets stuck, by other starts and the other method.
class Attempts {
 public:
  Attempts(Nlp& problem, const std::vector<double>& start, const SolverOptions& options)
      : problem_(problem),
        start_(start),
        options_(options),
        first_(method_for(problem.shape(), options)),
        other_(first_ == NlpMethod::kIpopt ? NlpMethod::kRiccati : NlpMethod::kIpopt),
        has_others_(options.try_other_method && !options.limited_memory &&
                    problem.shape().hessian_kind != HessianKind::kLimitedMemory) {}

  NlpSolution solve() {
    SolverOptions of_first = options_;
    if (has_others_ && !options_.warm && options_.first_barrier == 0)
      of_first.max_iterations = pause(options_);
    solution_ = solve_by(first_, problem_, start_, of_first);
    if (!has_others_) return std::move(solution_);
    if (solution_.status == SolveStatus::kAcceptable) {
      const auto stalled = std::make_shared<const NlpSolution>(solution_);
      solved_by(other_, stalled->x, "where the first method ended", stalled);
    } else if (is_paused(solution_, of_first)) {
      const NlpSolution paused = solution_;
      if (!solved_by(first_, bent(), kBent) && !solved_by(other_, start_, kGuess)) resume(first_, paused);
    } else if (is_stuck(solution_.status)) {
      if (!solved_by(other_, start_, kGuess) && !solved_by(first_, bent(), kBent) && paused_)
        resume(other_, *paused_);
    }
    return std::move(solution_);
  }

 private:
  static constexpr const char *kGuess = "the guess", *kBent = "the guess, bent to one side";

  static int pause(const SolverOptions& options) {
    return std::min(options.max_iterations, kIterationsBeforeOthers);
  }
  bool is_paused(const NlpSolution& solution, const SolverOptions& of_attempt) const {
    return solution.status == SolveStatus::kIterationLimit &&
           of_attempt.max_iterations < options_.max_iterations;
  }
  std::vector<double> bent() const { return dyntape::bent(problem_, start_, solution_.units); }

  SolverOptions left(NlpMethod method) const {
    SolverOptions of_method = less(options_, solution_);
    of_method.warm = nullptr;
    of_method.first_barrier = 0;
    if (method != first_) of_method.extra.clear();
    return of_method;
  }

  // Solves once more and returns whether that succeeded.  Its iterations and times are added in any case.
  bool solved_by(NlpMethod method, const std::vector<double>& from, const char* name,
                 std::shared_ptr<const NlpSolution> warm = nullptr) {
    SolverOptions of_method = left(method);
    if (!warm) of_method.max_iterations = pause(of_method);
    of_method.warm = std::move(warm);
    if (of_method.max_iterations == 0 || options_.stop.stop_requested()) return false;
    try {
      NlpSolution found = solve_by(method, problem_, from, of_method);
      if (method == other_ && is_paused(found, of_method)) paused_ = found;
      return take(method, std::move(found), name, false);
    } catch (const ArgumentError&) {   // a program that the other method does not support
    } catch (const NumericalError&) {  // or functions that are not finite at its start
    }
    return false;
  }

  // Continues a paused attempt with all remaining iterations.
  void resume(NlpMethod method, const NlpSolution& paused) {
    SolverOptions rest = left(method);
    rest.warm = std::make_shared<const NlpSolution>(paused);
    if (rest.max_iterations == 0 || options_.stop.stop_requested()) return;
    take(method, solve_by(method, problem_, paused.x, rest), "where an earlier attempt paused",
         method == first_);
  }

  bool take(NlpMethod method, NlpSolution found, const char* name, bool in_any_case) {
    const bool is_solved = found.status == SolveStatus::kSolved;
    found.attempts.front().start = name;
    NlpSolution both = joined(solution_, std::move(found));
    both.is_by_other_method = method != first_;
    if (is_solved || in_any_case) {
      solution_ = std::move(both);
    } else {
      solution_.log = std::move(both.log), solution_.times = both.times;
      solution_.attempts = std::move(both.attempts);
    }
    return is_solved;
  }

  Nlp& problem_;
  const std::vector<double>& start_;
  const SolverOptions& options_;
  NlpMethod first_, other_;
  bool has_others_;
  NlpSolution solution_;
  std::optional<NlpSolution> paused_;  // of the other method
};

}  // namespace

NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  return Attempts(problem, start, options).solve();
}

}  // namespace dyntape
