// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/problem/scaled_time.h>

#include <cmath>

namespace dyntape {

namespace {

// The stage in real time, and the duration.
template <class T>
std::pair<Stage<T>, T> unscaled(const Stage<T>& s) {
  const Eigen::Index n = s.x.size() - 1;
  const T duration = s.x[n];
  return {{duration * s.t, s.x.head(n), s.a, s.u, s.p}, duration};
}

// f at the real time, times `factor` of the duration, and below it so many zeros.
template <class Factor>
StageFunction scaled(const StageFunction& f, Factor factor, Eigen::Index zeros = 0) {
  return [=](const auto& s) {
    const auto [real, duration] = unscaled(s);
    auto values = f(real);
    const Eigen::Index n = values.size();
    values = (values * factor(duration)).eval();
    values.conservativeResize(n + zeros);
    for (Eigen::Index i = n; i < n + zeros; ++i) values[i] = 0;
    return values;
  };
}

StageFunction at_real_time(const StageFunction& f) {
  return [f](const auto& s) { return f(unscaled(s).first); };
}

Eigen::VectorXd with(const Eigen::VectorXd& values, double last) {
  Eigen::VectorXd all(values.size() + 1);
  all << values, last;
  return all;
}

Term scaled(const Term& term) {
  const auto once = [](const auto& duration) { return duration; };
  const auto root = [](const auto& duration) {
    using std::sqrt;
    return sqrt(duration);
  };
  Term result = term;
  result.function = at_real_time(term.function);
  if (!term.curvature.empty()) result.curvature = at_real_time(term.curvature);
  if (term.where != Where::kRunning) return result;
  if (!term.curvature.empty()) result.curvature = scaled(term.curvature, root);
  if (term.role == Role::kCost) result.function = scaled(term.function, once);
  if (term.role == Role::kSquares) result.function = scaled(term.function, root);
  return result;
}

}  // namespace

Problem scaled_time(const Problem& problem) {
  if (!problem.free_time) return problem;
  check(problem);
  const auto once = [](const auto& duration) { return duration; };
  const double first = problem.duration;
  Problem result = problem;
  result.free_time.reset();
  result.duration = 1;
  result.states.push_back("duration");
  result.rate = scaled(problem.rate, once, 1);
  result.ode = scaled(problem.ode, once, 1);
  if (!problem.residual.empty()) result.residual = at_real_time(problem.residual);
  for (Term& term : result.terms) term = scaled(term);
  result.x = {with(problem.x.lower, problem.free_time->shortest),
              with(problem.x.upper, problem.free_time->longest)};
  result.start = with(problem.start, Problem::kFree);
  result.goal = with(problem.goal, Problem::kFree);
  result.typical =
      with(problem.typical.size() ? problem.typical : Eigen::VectorXd::Zero(problem.n_x()), first);
  result.most_typical =
      with(problem.most_typical.size() ? problem.most_typical : Eigen::VectorXd::Zero(problem.n_x()), 0);
  const auto guess = problem.guess ? problem.guess : straight_line(problem);
  result.guess = [guess, first](double tau) {
    Stage<double> stage = guess(first * tau);
    stage.t = tau;
    stage.x = with(stage.x, first);
    return stage;
  };
  return result;
}

}  // namespace dyntape
