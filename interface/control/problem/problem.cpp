// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/problem/problem.h>

#include <algorithm>
#include <cmath>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/own_sines.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

Bounds unbounded(Eigen::Index n) {
  const double infinity = std::numeric_limits<double>::infinity();
  return {Eigen::VectorXd::Constant(n, -infinity), Eigen::VectorXd::Constant(n, infinity)};
}

void check_size(const Problem& problem, const std::string& part, Eigen::Index size, Eigen::Index expected) {
  if (size == expected) return;
  refuse(problem, part + " has " + std::to_string(size) + " entries, expected " + std::to_string(expected));
}

void check_bounds(const Problem& problem, const Bounds& bounds, const std::vector<std::string>& names,
                  const std::string& part) {
  const auto n = static_cast<Eigen::Index>(names.size());
  check_size(problem, "the lower bound of the " + part, bounds.lower.size(), n);
  check_size(problem, "the upper bound of the " + part, bounds.upper.size(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    check_room(problem, "\"" + names[static_cast<std::size_t>(i)] + "\"", bounds.lower[i], bounds.upper[i]);
  }
}

// Outside its bounds by more than rounding.
bool outside(double value, double lower, double upper) {
  const double slack = 1e-12 * std::max(1.0, std::abs(value));
  return value < lower - slack || value > upper + slack;
}

void check_boundary(const Problem& problem, const Eigen::VectorXd& values, const std::string& part) {
  check_size(problem, part, values.size(), problem.n_x());
  for (int i = 0; i < problem.n_x(); ++i) {
    if (std::isinf(values[i]))
      refuse(problem, part + " of \"" + problem.states[static_cast<std::size_t>(i)] + "\" is " +
                          std::to_string(values[i]) + ", expected a number, or none (Problem::kFree)");
    if (!std::isnan(values[i]) && outside(values[i], problem.x.lower[i], problem.x.upper[i]))
      refuse(problem, part + " of \"" + problem.states[static_cast<std::size_t>(i)] + "\" is " +
                          std::to_string(values[i]) + ", outside its bounds " +
                          std::to_string(problem.x.lower[i]) + " to " + std::to_string(problem.x.upper[i]));
  }
}

// What is recorded of names cannot change with values.
void check_same_names(const Problem& problem, const std::vector<std::string>& names,
                      const std::vector<std::string>& now, const std::string& part) {
  if (now == names) return;
  const auto differs = std::mismatch(names.begin(), names.end(), now.begin(), now.end());
  const auto name_at = [](const auto& at, const auto& end) { return at == end ? "none" : "\"" + *at + "\""; };
  refuse(problem, "the " + part + " are others than were recorded: " + name_at(differs.second, now.end()) +
                      ", expected " + name_at(differs.first, names.end()));
}

void check_guess(const Problem& problem) {
  if (!problem.guess) return;
  for (double t : {0.0, problem.duration}) {
    const Stage<double> stage = problem.guess(t);
    check_size(problem, "the state of the guess", stage.x.size(), problem.n_x());
    check_size(problem, "the acceleration of the guess", stage.a.size(), problem.n_a());
    check_size(problem, "the control of the guess", stage.u.size(), problem.n_u());
  }
}

void check_free_time(const Problem& problem) {
  if (!problem.free_time) return;
  const auto [shortest, longest] = *problem.free_time;
  if (!(shortest > 0 && shortest <= longest && std::isfinite(longest)))
    refuse(problem, "the duration lies between " + std::to_string(shortest) + " and " +
                        std::to_string(longest) + " s, expected two positive numbers, the shorter one first");
  if (!(problem.duration >= shortest && problem.duration <= longest))
    refuse(problem, "the first guess of the duration is " + std::to_string(problem.duration) +
                        " s, expected " + std::to_string(shortest) + " to " + std::to_string(longest));
  const std::string varies = problem.parameters.first_of_time();
  if (varies.empty()) return;
  refuse(problem, "the parameter \"" + varies +
                      "\" varies with time, which points have only where the duration is given; expected a "
                      "function of s.t in the terms");
}

}  // namespace

Term running_cost(std::string name, StageFunction function) {
  return {std::move(name), Where::kRunning, Role::kCost, std::move(function)};
}
Term running_squares(std::string name, StageFunction residuals) {
  return {std::move(name), Where::kRunning, Role::kSquares, std::move(residuals)};
}
Term path_equality(std::string name, StageFunction residuals) {
  return {std::move(name), Where::kRunning, Role::kEquality, std::move(residuals)};
}
Term path_inequality(std::string name, StageFunction values, Eigen::VectorXd lower, Eigen::VectorXd upper) {
  return {std::move(name),   Where::kRunning,  Role::kInequality,
          std::move(values), std::move(lower), std::move(upper)};
}
Term path_not_negative(std::string name, StageFunction value) {
  return path_inequality(std::move(name), std::move(value), Eigen::VectorXd::Zero(1),
                         Eigen::VectorXd::Constant(1, std::numeric_limits<double>::infinity()));
}
Term terminal_cost(std::string name, StageFunction function) {
  return {std::move(name), Where::kTerminal, Role::kCost, std::move(function)};
}
Term terminal_squares(std::string name, StageFunction residuals) {
  return {std::move(name), Where::kTerminal, Role::kSquares, std::move(residuals)};
}
Term terminal_equality(std::string name, StageFunction residuals) {
  return {std::move(name), Where::kTerminal, Role::kEquality, std::move(residuals)};
}
Term terminal_inequality(std::string name, StageFunction values, Eigen::VectorXd lower,
                         Eigen::VectorXd upper) {
  return {std::move(name),   Where::kTerminal, Role::kInequality,
          std::move(values), std::move(lower), std::move(upper)};
}

Term at_fraction(double share, Term term) {
  if (!(share >= 0 && share <= 1))
    throw ArgumentError("the term \"" + term.name + "\" is at " + std::to_string(share) +
                        " of the duration, expected a share from 0 to 1");
  term.where = share == 1 ? Where::kTerminal : Where::kInstant;
  term.share = share;
  return term;
}

Term at_start(Term term) { return at_fraction(0, std::move(term)); }

bool stands_at(const Term& term, double share) {
  return term.where == Where::kTerminal ? share == 1 : term.where == Where::kInstant && term.share == share;
}

std::vector<double> instants_of(const Problem& problem) {
  std::set<double> shares = {1};
  for (const Term& term : problem.terms) {
    if (term.where == Where::kInstant) shares.insert(term.share);
  }
  return {shares.begin(), shares.end()};
}

std::string name_of_instant(double share) {
  if (share == 0) return "the start";
  return share == 1 ? "the end" : io::shortest(share) + " of the duration";
}

Term minimum_time(double weight) {
  if (!(weight > 0 && std::isfinite(weight)))
    throw ArgumentError("the weight of the time is " + std::to_string(weight) +
                        ", expected a positive number");
  return terminal_squares("time", [weight](const auto& s) {
    using std::sqrt, std::log, own::cos, own::sin;
    using T = std::decay_t<decltype(s.t)>;
    const T root = sqrt(s.t * weight), turn = log(s.t);
    return vector(T(root * cos(turn)), T(root * sin(turn)));
  });
}

Problem::Problem(std::string name_, std::vector<std::string> states_, std::vector<std::string> controls_,
                 double duration_, StageFunction rate_)
    : name(std::move(name_)),
      states(std::move(states_)),
      controls(std::move(controls_)),
      duration(duration_),
      rate(rate_),
      ode(std::move(rate_)),
      x(unbounded(n_x())),
      a(unbounded(0)),
      u(unbounded(n_u())),
      start(Eigen::VectorXd::Constant(n_x(), kFree)),
      goal(Eigen::VectorXd::Constant(n_x(), kFree)) {}

void Problem::use_accelerations(std::vector<std::string> names, StageFunction residual_, StageFunction ode_) {
  accelerations = std::move(names);
  residual = std::move(residual_);
  ode = std::move(ode_);
  a = unbounded(n_a());
}

Stage<double> Problem::first_guess(double t) const { return guess ? guess(t) : straight_line(*this)(t); }

void Problem::take_values(const Problem& now) {
  parameters.check_same(now.parameters);
  if (free_time.has_value() != now.free_time.has_value() || (!free_time && duration != now.duration)) {
    throw ArgumentError("problem \"" + name + "\": the duration is another one than was recorded; expected " +
                        (free_time ? "a free one" : std::to_string(duration) + " s"));
  }
  check_same_names(*this, states, now.states, "states");
  check_same_names(*this, accelerations, now.accelerations, "accelerations");
  check_same_names(*this, controls, now.controls, "controls");
  if (terms.size() != now.terms.size())
    throw ArgumentError("problem \"" + name + "\": the new values come with " +
                        std::to_string(now.terms.size()) + " terms, expected the " +
                        std::to_string(terms.size()) + " that were recorded");
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const Term &known = terms[k], &next = now.terms[k];
    if (known.name != next.name || known.lower != next.lower || known.upper != next.upper)
      throw ArgumentError("problem \"" + name + "\": the new values come with other bounds of the term \"" +
                          next.name + "\", or another term, than were recorded (\"" + known.name +
                          "\"); expected the same, or another recording");
  }
  parameters = now.parameters;
  start = now.start;
  goal = now.goal;
  x = now.x;
  a = now.a;
  u = now.u;
  guess = now.guess;
  free_time = now.free_time;
  duration = now.duration;
  check(*this);
}

std::function<Stage<double>(double t)> straight_line(const Problem& problem) {
  Eigen::VectorXd from = problem.start, to = problem.goal;
  for (int i = 0; i < problem.n_x(); ++i) {
    if (std::isnan(from[i])) from[i] = std::isnan(to[i]) ? 0 : to[i];
    if (std::isnan(to[i])) to[i] = from[i];
  }
  const Eigen::VectorXd a = Eigen::VectorXd::Zero(problem.n_a()),
                        u = problem.u.lower.cwiseMax(0).cwiseMin(problem.u.upper);
  const double duration = problem.duration;
  return [=](double t) { return Stage<double>{t, from + (to - from) * (t / duration), a, u}; };
}

void refuse(const Problem& problem, const std::string& what) {
  throw ArgumentError("problem \"" + problem.name + "\": " + what);
}

void check_rate(const Problem& problem, Eigen::Index entries) {
  if (entries == problem.n_x()) return;
  refuse(problem, "the rate has " + std::to_string(entries) +
                      " entries, expected one a state: " + std::to_string(problem.n_x()));
}

void check_cost(const Problem& problem, const std::string& name, Eigen::Index entries) {
  if (entries == 1) return;
  refuse(problem, "the cost \"" + name + "\" has " + std::to_string(entries) + " entries, expected a scalar");
}

void check_room(const Problem& problem, const std::string& what, double lower, double upper) {
  if (lower <= upper && lower < HUGE_VAL && upper > -HUGE_VAL) return;
  refuse(problem,
         "the bounds of " + what + " are empty: " + std::to_string(lower) + " to " + std::to_string(upper));
}

void check(const Problem& problem) {
  if (!(problem.duration > 0 && std::isfinite(problem.duration)))
    refuse(problem, "the duration is " + std::to_string(problem.duration) + " s, expected a positive number");
  if (problem.states.empty()) refuse(problem, "there are no states; expected one or more");
  if (problem.positions < 0 || problem.positions > problem.n_x())
    refuse(problem, std::to_string(problem.positions) + " states are positions, expected 0 to " +
                        std::to_string(problem.n_x()));
  check_free_time(problem);
  for (const Term& term : problem.terms) {
    if (term.where == Where::kInstant) at_fraction(term.share, term);  // throws
  }
  check_bounds(problem, problem.x, problem.states, "states");
  check_bounds(problem, problem.a, problem.accelerations, "accelerations");
  check_bounds(problem, problem.u, problem.controls, "controls");
  if (problem.typical.size() > 0)
    check_size(problem, "what states typically move", problem.typical.size(), problem.n_x());
  if (problem.most_typical.size() > 0)
    check_size(problem, "the most that states typically move", problem.most_typical.size(), problem.n_x());
  check_boundary(problem, problem.start, "the start");
  check_boundary(problem, problem.goal, "the goal");
  check_guess(problem);
}

}  // namespace dyntape
