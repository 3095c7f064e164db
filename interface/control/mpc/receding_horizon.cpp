// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/mpc/receding_horizon.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/riccati/second_order.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

const Problem& checked(const Problem& problem) {
  const auto refuse = [&](const std::string& what) { dyntape::refuse(problem, what); };
  if (problem.free_time) refuse("its duration is free, expected a horizon");
  for (const Term& term : problem.terms) {
    if (term.where == Where::kInstant && term.share > 0)
      refuse("the term \"" + term.name + "\" is at " + name_of_instant(term.share) +
             ", which recedes with the horizon and is never reached; expected a running term whose target or "
             "weight is a parameter of time");
  }
  for (int i = 0; i < problem.n_x(); ++i) {
    if (std::isnan(problem.start[i]))
      refuse("the start of \"" + problem.states[std::size_t(i)] + "\" is free, expected a state to begin at");
  }
  return problem;
}

// A first guess that each step asks for at the same times: it may be what holds a robot, which takes its dynamics.
Problem with_remembered_guess(Problem problem) {
  if (!problem.guess) return problem;
  struct Known {
    std::function<Stage<double>(double t)> guess;
    std::map<double, Stage<double>> stages;
    std::mutex mutex;
  };
  const auto known = std::make_shared<Known>();
  known->guess = std::move(problem.guess);
  problem.guess = [known](double t) {
    const std::lock_guard<std::mutex> lock(known->mutex);
    const auto at = known->stages.find(t);
    return at != known->stages.end() ? at->second : known->stages.emplace(t, known->guess(t)).first->second;
  };
  return problem;
}

// Functions that only answer for names and sizes need no compiler.
MeshOptions interpreted(MeshOptions mesh) {
  mesh.evaluation.route = Route::kInterpreter;
  return mesh;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

void put_at_equal_bounds(const NlpShape& shape, std::vector<double>& x) {
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (shape.x_lower[i] == shape.x_upper[i]) x[i] = shape.x_lower[i];
  }
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

namespace {

// The space between times that holds one: k with times(k) <= t, of `count` of them; and the fraction of it.
template <class Times>
std::pair<int, double> place_in(const Times& times, int count, double t) {
  int k = 0;
  while (k + 1 < count && times(k + 1) <= t) ++k;
  return {k, (t - times(k)) / (times(k + 1) - times(k))};
}

// How far a measured state is off its guess says how far states move, unless that is next to nothing.
NlpScaling larger(NlpScaling measured, NlpScaling as_made) {
  constexpr double kLittle = 0.01;
  for (std::size_t i = 0; i < measured.x.size(); ++i) {
    if (measured.x[i] < kLittle * as_made.x[i]) return as_made;
  }
  return measured;
}

}  // namespace

Eigen::VectorXd Plan::control(double t) const {
  const double now = std::clamp(t - begin, 0.0, motion.t[motion.points() - 1]);
  const auto [k, fraction] =
      place_in([&](int i) { return motion.t[motion.node(i)]; }, motion.intervals(), now);
  return motion.control(k, fraction);
}

Eigen::VectorXd Plan::state(double t) const {
  const double now = std::clamp(t - begin, 0.0, motion.t[motion.points() - 1]);
  const auto [k, share] = place_in([&](int p) { return motion.t[p]; }, motion.points() - 1, now);
  if (rates.size() > 0)
    return cubic(motion.x.col(k), motion.x.col(k + 1), rates.col(k), rates.col(k + 1),
                 motion.t[k + 1] - motion.t[k], share);
  return (1 - share) * motion.x.col(k) + share * motion.x.col(k + 1);
}

Eigen::VectorXd Plan::correction(double t, const Eigen::VectorXd& x) const {
  if (gain.size() == 0) return Eigen::VectorXd::Zero(motion.u.rows());
  const Eigen::VectorXd planned = state(t);
  return gain * (difference ? difference(planned, x) : Eigen::VectorXd(x - planned));
}

Eigen::VectorXd Plan::control(double t, const Eigen::VectorXd& x) const {
  return gain.size() > 0 ? limited(control(t) + correction(t, x)) : control(t);
}

RecedingHorizon::RecedingHorizon(const Problem& problem, const MpcOptions& options)
    : options_(options),
      values_(with_remembered_guess(checked(problem))),
      program_(discretize(values_, options.printed ? interpreted(options.mesh) : options.mesh)) {
  if (options.iterations < 0)
    refuse(problem, std::to_string(options.iterations) +
                        " iterations a step, expected 0 (until it is solved) or more");
  if (!(options.solver.tolerance > 0))
    refuse(problem, "the tolerance of a step is " + io::shortest(options.solver.tolerance) +
                        ", expected a positive number");
  if (!options.printed) return;
  ControllerOptions printed;
  printed.mesh = options.mesh;
  // Products of slacks and multipliers then end at solver.tolerance, as in the solver.
  printed.tolerance = std::sqrt(options.solver.tolerance);
  printed_ = std::make_unique<ControllerLibrary>(values_, printed, options.mesh.evaluation);
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
    if (system_ && !EqualityQp::fits(model_->shape())) system_.reset();
    if (system_) put_at_equal_bounds(model_->shape(), x);
    if (!model_->expand(x, last_.lambda)) {
      last_.status = SolveStatus::kNotFinite;
      return i;
    }
    last_ = system_ ? system_->solve() : of_model_->solve(x, options_.solver);
    const bool is_small = largest_difference(x, last_.x) <= options_.solver.tolerance;
    x = last_.x;
    if (last_.status != SolveStatus::kSolved || (is_small && i > 0)) return i + 1;
  }
  if (last_.status == SolveStatus::kSolved) last_.status = SolveStatus::kIterationLimit;
  return options_.iterations;
}

// Solves, or goes on from the last solution, and says what came of it.
void RecedingHorizon::choose_derivatives(bool is_stepwise) {
  if (is_stepwise && system_)
    derivatives_ = [this](const auto& held) { return system_->derivatives(held); };
  else
    derivatives_ = [planner = is_stepwise ? of_model_.get() : solver_.get()](const auto& held) {
      return planner->derivatives(held);
    };
}

void RecedingHorizon::plan_from(const std::vector<double>& start, double t, From from) {
  const bool goes_on = from == From::kLastSolution, is_stepwise = goes_on && options_.iterations > 0;
  choose_derivatives(is_stepwise);
  if (is_stepwise) {
    step_.iterations += quadratic_steps(start);
  } else {
    last_ = solver_->solve(start, options_.solver, goes_on ? &last_ : nullptr);
    step_.iterations += last_.iterations();
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

// Whether the plan is a minimum, after another solve where it was none.
bool RecedingHorizon::leave_saddle(double t) {
  const auto is_minimum = [&] {
    return check_second_order(*scaled_, last_).order != StationaryPoint::kNotMinimum;
  };
  if (step_.status != SolveStatus::kSolved || is_minimum()) return true;
  const double before = step_.cost;
  const NlpSolution found = solve_with_riccati(program_, program_.start(), options_.solver);
  step_.iterations += found.iterations();
  if (!(found.objective < before)) return false;
  plan_from(scaled_->in_scaled_units(found.x), t, From::kPoint);
  return step_.status != SolveStatus::kSolved || is_minimum();
}

// How the first control changes with the first state.
void RecedingHorizon::add_gain() {
  Plan& plan = step_.plan;
  plan.gain.resize(0, 0), plan.rates.resize(0, 0);
  step_.gain_seconds = 0;
  if (!options_.gains || !step_.usable) return;
  const auto begin = std::chrono::steady_clock::now();
  const Trajectory& motion = plan.motion;
  const Eigen::Index n_x = motion.x.rows(), n_u = motion.u.rows(), first = n_x + motion.a.rows();
  std::vector<std::size_t> held;
  for (Eigen::Index i = 0; i < n_x; ++i) held.push_back(std::size_t(i));
  const Eigen::MatrixXd derivatives = derivatives_(held);
  if (derivatives.size() > 0) {
    const Eigen::Map<const Eigen::VectorXd> units(scaled_->units().x.data(), derivatives.rows());
    plan.gain = units.segment(first, n_u).asDiagonal() * derivatives.middleRows(first, n_u) *
                units.head(n_x).cwiseInverse().asDiagonal();
    plan.rates = rates_of(program_.problem(), motion);
  }
  step_.gain_seconds = seconds_since(begin);
}

NlpSolution RecedingHorizon::solution() const {
  if (printed_)
    refuse(values_, "a controller that runs printed text has no solution(); expected one without `printed`");
  if (!scaled_) refuse(values_, "the controller has no plan yet; expected a step before solution()");
  NlpSolution own = scaled_->in_own_units(last_);
  own.units = scaled_->units();
  return own;
}

// A later plan, from the last one moved to now.
void RecedingHorizon::plan_again(const std::vector<double>& start, const std::vector<double>& moved_plan,
                                 double t, const Eigen::VectorXd& x) {
  if (system_ && options_.iterations > 0) return plan_from(moved_plan, t, From::kLastSolution);
  const NlpSolution before = last_;
  std::vector<double> from_here = start;
  std::copy(x.begin(), x.end(), from_here.begin());
  const bool is_far = violation_of(*scaled_, scaled_->in_scaled_units(from_here)) > kFar;
  for (const From from : is_far ? std::array{From::kPoint, From::kLastSolution}
                                : std::array{From::kLastSolution, From::kPoint}) {
    last_ = before;
    plan_from(moved_plan, t, from);
    if (step_.usable) return;
  }
  plan_from(scaled_->in_scaled_units(program_.start()), t, From::kPoint);
}

void RecedingHorizon::check_step(double t, const Eigen::VectorXd& x) const {
  const std::string where = "problem \"" + values_.name + "\": ";
  if (x.size() != values_.n_x() || !x.allFinite())
    throw ArgumentError(where + "the state measured at t = " + io::shortest(t) + " s has " +
                        std::to_string(x.size()) + " entries" +
                        (x.allFinite() ? "" : ", not all of them numbers") + "; expected " +
                        std::to_string(values_.n_x()) + " numbers");
  if (!std::isfinite(t) || (has_plan_ && t < step_.plan.begin))
    throw ArgumentError(where + "a step at t = " + io::shortest(t) +
                        " s, expected a time after the last one's, " + io::shortest(step_.plan.begin) + " s");
}

// By the text: the first step until it is solved, like the others without `iterations`.
const MpcStep& RecedingHorizon::printed_step(double t, const Eigen::VectorXd& x) {
  const auto begin = std::chrono::steady_clock::now();
  printed_->values().parameters = values_.parameters;
  const bool is_bounded = has_plan_ && options_.iterations > 0;
  const ControllerStep found = printed_->step(t, x, is_bounded ? options_.iterations : 1 << 20);
  step_.status = found.status == ControllerStep::Status::kSolved        ? SolveStatus::kSolved
                 : found.status == ControllerStep::Status::kBudgetEnded ? SolveStatus::kIterationLimit
                                                                        : SolveStatus::kNotFinite;
  step_.plan.begin = t;
  step_.plan.motion = printed_->plan();
  step_.plan.limits = values_.u;
  step_.plan.difference = values_.difference;
  step_.iterations = found.iterations, step_.cost = found.cost, step_.violation = found.violation;
  step_.usable = found.status == ControllerStep::Status::kSolved ||
                 (found.usable() && found.violation <= options_.violation);
  step_.plan.gain.resize(0, 0), step_.plan.rates.resize(0, 0);
  if (options_.gains && step_.usable) {
    step_.plan.gain = printed_->gain();
    step_.plan.rates = rates_of(program_.problem(), step_.plan.motion);
  }
  has_plan_ = found.usable();
  step_.seconds = seconds_since(begin);
  if (step_.usable) {
    latest_.write() = step_.plan;
    latest_.publish();
  }
  return step_;
}

const MpcStep& RecedingHorizon::step(double t, const Eigen::VectorXd& x) {
  check_step(t, x);
  if (printed_) return printed_step(t, x);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<double> start;
  if (has_plan_) start = moved(t - step_.plan.begin);
  NlpScaling as_made;
  if (!has_plan_) as_made = program_.scaling(program_.start());
  Problem now = values_;
  now.start = x.cwiseMax(now.x.lower).cwiseMin(now.x.upper);
  now.parameters = values_.parameters.later(t);
  program_.set_values(now);
  program_.start_at(x);
  if (!has_plan_) {
    start = program_.start();
    program_.check_finite(start);
    scaled_ = std::make_unique<ScaledNlp>(program_, larger(program_.scaling(start), std::move(as_made)));
    solver_ = std::make_unique<StructuredInteriorPoint>(*scaled_);
    model_ = std::make_unique<QpSubproblem>(*scaled_);
    of_model_ = std::make_unique<StructuredInteriorPoint>(*model_);
    if (EqualityQp::fits(model_->shape())) system_ = std::make_unique<EqualityQp>(*model_);
  }
  scaled_->take_bounds();
  step_.iterations = 0;
  const std::vector<double> moved_plan = scaled_->in_scaled_units(start);
  if (!has_plan_) {
    plan_from(moved_plan, t, From::kPoint);
    step_.is_minimum = leave_saddle(t);
    if (!step_.is_minimum) step_.status = SolveStatus::kAcceptable;
  } else {
    plan_again(start, moved_plan, t, x);
  }
  has_plan_ = step_.plan.motion.x.allFinite() && step_.plan.motion.u.allFinite();
  step_.plan.limits = values_.u;
  step_.plan.difference = values_.difference;
  add_gain();
  step_.seconds = seconds_since(begin);
  if (step_.usable) {
    latest_.write() = step_.plan;
    latest_.publish();
  }
  return step_;
}

}  // namespace dyntape
