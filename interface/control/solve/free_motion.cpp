// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/free_motion.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/ipopt/rounds.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr double kGuessTolerance = 1e-6;  // of a guess

}  // namespace

std::optional<Trajectory> free_motion(const StagedNlp& program) {
  const Problem& problem = program.problem();
  if (problem.start.size() != problem.n_x() || !problem.start.allFinite()) return std::nullopt;
  // Accelerations are the rates of the last states, as of robots.
  if (problem.n_a() > problem.n_x() - problem.positions) return std::nullopt;
  const auto control = [&](double t) {
    return VectorXd(problem.first_guess(t).u.cwiseMax(problem.u.lower).cwiseMin(problem.u.upper));
  };
  const std::vector<double> times = program.times();
  Trajectory motion = program.trajectory(program.start());
  motion.x.col(0) = problem.start;
  for (std::size_t k = 1; k < times.size(); ++k) {
    const Simulation next = simulate(problem, motion.x.col(Eigen::Index(k) - 1), times[k - 1], times[k],
                                     control, kGuessTolerance);
    if (!next.trouble.empty()) return std::nullopt;
    motion.x.col(Eigen::Index(k)) = next.x;
  }
  for (std::size_t k = 0; k < times.size(); ++k) {
    const auto p = Eigen::Index(k);
    motion.u.col(p) = control(times[k]);
    const VectorXd rate = problem.ode(problem.stage(times[k], motion.x.col(p), {}, motion.u.col(p)));
    motion.a.col(p) = rate.tail(problem.n_a());
  }
  const VectorXd end = motion.x.rightCols(1);
  for (Eigen::Index i = 0; i < std::min(end.size(), problem.goal.size()); ++i) {
    if (std::isnan(problem.goal[i])) continue;
    for (std::size_t k = 0; k < times.size(); ++k)
      motion.x(i, Eigen::Index(k)) += (problem.goal[i] - end[i]) * times[k] / times.back();
  }
  return motion;
}

NlpSolution solve_or_let_go(Nlp& program, const std::vector<double>& start, const SolverOptions& options,
                            const std::function<std::optional<std::vector<double>>()>& elsewhere) {
  NlpSolution solution = solve_nlp(program, start, options);
  if (!is_stuck(solution.status) || !options.try_other_method) return solution;
  SolverOptions left = less(options, solution);
  left.warm = nullptr;
  if (left.max_iterations == 0 || options.stop.stop_requested()) return solution;
  try {
    std::optional<std::vector<double>> from = elsewhere();
    if (!from) return solution;
    const NlpShape& shape = program.shape();
    for (std::size_t i = 0; i < from->size(); ++i)
      (*from)[i] = std::clamp((*from)[i], shape.x_lower[i], shape.x_upper[i]);
    NlpSolution found = solve_nlp(program, *from, left);
    found.attempts.front().start = "the motion that the guess's controls make";
    const bool is_solved = found.status == SolveStatus::kSolved;
    NlpSolution both = joined(solution, std::move(found));
    if (is_solved) return both;
    solution.log = std::move(both.log), solution.times = both.times;
    solution.attempts = std::move(both.attempts);
  } catch (const NumericalError&) {  // no finite value there
  }
  return solution;
}

}  // namespace dyntape
