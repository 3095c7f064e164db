// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/mpc/receding_horizon.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/transcription/refine.h>

namespace dyntape {

namespace {

const Problem& checked(const Problem& problem) {
  const auto refuse = [&](const std::string& what) {
    throw ArgumentError("problem \"" + problem.name + "\": " + what);
  };
  if (problem.free_time) refuse("its duration is free, expected a horizon");
  for (const Term& term : problem.terms) {
    if (term.where == Where::kInstant && term.share > 0)
      refuse("the term \"" + term.name + "\" stands at " + name_of_instant(term.share) +
             ", which recedes with the horizon and is never reached; expected a running term whose target or "
             "weight is a parameter of time");
  }
  for (int i = 0; i < problem.n_x(); ++i) {
    if (std::isnan(problem.start[i]))
      refuse("the start of \"" + problem.states[std::size_t(i)] + "\" is free, expected a state to begin at");
  }
  return problem;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

// Of rows; infinite where there are none to be had.
double violation_of(Nlp& nlp, const std::vector<double>& x) {
  std::vector<double> g(nlp.shape().m());
  if (!nlp.constraints(x.data(), g.data())) return HUGE_VAL;
  double most = 0;
  for (std::size_t j = 0; j < g.size(); ++j)
    most = std::max({most, nlp.shape().g_lower[j] - g[j], g[j] - nlp.shape().g_upper[j]});
  return most;
}

}  // namespace

Eigen::VectorXd Plan::control(double t) const {
  const int last = motion.intervals() - 1;
  const double now = std::clamp(t - begin, 0.0, motion.t[motion.points() - 1]);
  int k = 0;
  while (k < last && motion.t[motion.node(k + 1)] <= now) ++k;
  const double from = motion.t[motion.node(k)], to = motion.t[motion.node(k + 1)];
  return motion.control(k, (now - from) / (to - from));
}

Eigen::VectorXd Plan::state(double t) const {
  const double now = std::clamp(t - begin, 0.0, motion.t[motion.points() - 1]);
  int k = 0;
  while (k + 2 < motion.points() && motion.t[k + 1] <= now) ++k;
  const double share = (now - motion.t[k]) / (motion.t[k + 1] - motion.t[k]);
  return (1 - share) * motion.x.col(k) + share * motion.x.col(k + 1);
}

RecedingHorizon::RecedingHorizon(const Problem& problem, const MpcOptions& options)
    : options_(options), values_(checked(problem)), program_(problem, options.mesh) {
  if (options.iterations < 0)
    throw ArgumentError("problem \"" + problem.name + "\": " + std::to_string(options.iterations) +
                        " iterations a step, expected 0 (until it is solved) or more");
}

// The last solution's variables as they are `by` later, and its multipliers.
std::vector<double> RecedingHorizon::moved(double by) {
  const Trajectory& before = step_.plan.motion;
  std::vector<double> times = program_.times();
  const double end = times.back(), interval = end / before.intervals();
  for (double& t : times) t = std::min(t + by, end);
  program_.make_earlier(last_, int(std::lround(by / interval)));
  Trajectory motion = resampled(program_.problem(), before, times);
  motion.t = before.t;
  return program_.variables(motion);
}

// Steps of sequential quadratic programming, each whole; how many were taken.
int RecedingHorizon::quadratic_steps(std::vector<double> x) {
  last_.x = x;
  for (int i = 0; i < options_.iterations; ++i) {
    model_->take_bounds();
    if (!model_->expand(x, last_.lambda)) {
      last_.status = SolveStatus::kNotFinite;
      return i;
    }
    last_ = of_model_->solve(x, options_.solver);
    const bool is_small = largest_difference(x, last_.x) <= options_.solver.tolerance;
    x = last_.x;
    if (last_.status != SolveStatus::kSolved || (is_small && i > 0)) return i + 1;
  }
  if (last_.status == SolveStatus::kSolved) last_.status = SolveStatus::kIterationLimit;
  return options_.iterations;
}

// Solves, or goes on from the last solution, and says what came of it.
void RecedingHorizon::plan_from(const std::vector<double>& start, double t, bool goes_on) {
  const bool is_stepwise = goes_on && options_.iterations > 0;
  if (is_stepwise) {
    step_.iterations = quadratic_steps(start);
  } else {
    last_ = solver_->solve(start, options_.solver, goes_on ? &last_ : nullptr);
    step_.iterations = last_.iterations();
  }
  const NlpSolution own = scaled_->in_own_units(last_);
  step_.plan.begin = t;
  step_.plan.motion = program_.trajectory(own.x);
  step_.status = own.status;
  step_.cost = own.objective;
  step_.violation = violation_of(*scaled_, last_.x);
  const bool is_solved = step_.status == SolveStatus::kSolved || step_.violation <= options_.violation;
  step_.usable = is_solved && step_.plan.motion.u.allFinite();
}

const MpcStep& RecedingHorizon::step(double t, const Eigen::VectorXd& x) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string where = "problem \"" + values_.name + "\": ";
  if (x.size() != values_.n_x() || !x.allFinite())
    throw ArgumentError(where + "the state measured at t = " + io::shortest(t) + " s has " +
                        std::to_string(x.size()) + " entries" +
                        (x.allFinite() ? "" : ", not all of them numbers") + "; expected " +
                        std::to_string(values_.n_x()) + " numbers");
  if (!std::isfinite(t) || (has_plan_ && t < step_.plan.begin))
    throw ArgumentError(where + "a step at t = " + io::shortest(t) +
                        " s, expected a time after the last one's, " + io::shortest(step_.plan.begin) + " s");
  std::vector<double> start;
  if (has_plan_) start = moved(t - step_.plan.begin);
  Problem now = values_;
  now.start = x.cwiseMax(now.x.lower).cwiseMin(now.x.upper);
  now.parameters = values_.parameters.later(t);
  program_.set_values(now);
  program_.start_at(x);
  if (!has_plan_) {
    start = program_.start();
    program_.check_finite(start);
    scaled_ = std::make_unique<ScaledNlp>(program_, program_.magnitudes(start));
    solver_ = std::make_unique<StageSolver>(*scaled_);
    model_ = std::make_unique<QuadraticModel>(*scaled_);
    of_model_ = std::make_unique<StageSolver>(*model_);
  }
  scaled_->take_bounds();
  plan_from(scaled_->in_scaled_units(start), t, has_plan_);
  if (has_plan_ && !step_.usable) plan_from(scaled_->in_scaled_units(program_.start()), t, false);
  has_plan_ = step_.plan.motion.x.allFinite() && step_.plan.motion.u.allFinite();
  step_.seconds = seconds_since(begin);
  if (step_.usable) {
    latest_.write() = step_.plan;
    latest_.publish();
  }
  return step_;
}

}  // namespace dyntape
