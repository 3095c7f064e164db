// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/adaptive_steps.h>

#include <algorithm>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <limits>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// In less nothing moves (s); CVODES multiplies such times with each other, and nothing is left of shorter ones.
constexpr double kNoMotion = 1e-150;

const Tolerances& checked_tolerances(const System& system, const Tolerances& t) {
  const auto refuse = [&](const char* which, double got, const std::string& expected) {
    throw ArgumentError("system \"" + system.name + "\": the " + which + " tolerance is " +
                        io::shortest(got) + ", expected " + expected);
  };
  if (!(t.relative >= Tolerances::kLeastRelative && t.relative <= Tolerances::kMostRelative))
    refuse("relative", t.relative,
           io::shortest(Tolerances::kLeastRelative) + " to " + io::shortest(Tolerances::kMostRelative));
  if (!(t.absolute > 0 && std::isfinite(t.absolute))) refuse("absolute", t.absolute, "a positive number");
  return t;
}

Cvodes::Method method_of(Integrator integrator) {
  return integrator == Integrator::kAdaptiveStiff ? Cvodes::Method::kBackwardDifferentiation
                                                  : Cvodes::Method::kAdams;
}

}  // namespace

AdaptiveSteps::AdaptiveSteps(const System& system, Integrator integrator, const Tolerances& tolerances,
                             const CodegenOptions& options, bool with_jacobians)
    : is_stiff_(integrator == Integrator::kAdaptiveStiff),
      stop_(options.stop),
      problem_(system, integrator, checked_tolerances(system, tolerances), options, with_jacobians),
      solver_(problem_, problem_.n_y(), 0, tolerances.relative, tolerances.absolute, method_of(integrator)),
      was_above_(std::size_t(problem_.n_g())) {
  if (with_jacobians)
    with_sensitivities_.emplace(problem_, problem_.n_y(), problem_.n_w(), tolerances.relative,
                                tolerances.absolute, method_of(integrator));
  x_ = VectorXd::Zero(problem_.n_x());
  for (VectorXd* each : {&y_, &f_, &f_later_, &errors_}) *each = VectorXd::Zero(problem_.n_y());
}

bool AdaptiveSteps::step(const double* arguments, double* x_next) {
  const double h = arguments[problem_.n_x() + 1];
  t_ = arguments[problem_.n_x()];
  event_.reset();
  problem_.begin(arguments);
  if (problem_.n_g() > 0) {
    if (!problem_.events(0, arguments)) return has_no_value("the events", 0);
    for (Eigen::Index i = 0; i < problem_.n_g(); ++i) was_above_[std::size_t(i)] = problem_.g()[i] > 0;
  }
  length_ = h;
  if (!follow(solver_, h, problem_.n_g() > 0)) return false;
  if (!problem_.state(length_, y_.data(), x_next)) return has_no_value("the state", length_);
  return true;
}

bool AdaptiveSteps::jacobians(const double* arguments, Eigen::MatrixXd& matrix) {
  problem_.begin(arguments);
  Cvodes& solver = *with_sensitivities_;
  if (!follow(solver, length_, false)) return false;
  if (!problem_.frame(length_, y_.data())) return has_no_value("the frame", length_);
  problem_.moved(solver.sensitivities(), matrix);
  return true;
}

// From the beginning over a length, or to the first event, which shortens length_.  y_ is then the end.
bool AdaptiveSteps::follow(Cvodes& solver, double length, bool to_events) {
  problem_.start(y_.data());
  solver.begin(0, y_.data());
  solver.sensitivities().setIdentity();
  if (std::abs(length) < kNoMotion) return true;
  if (!start(solver, length)) return false;
  for (long k = 0; solver.s() != length; ++k) {
    const double before = solver.s();
    if (stop_.stop_requested()) return fails("stopped at " + at(before));
    if (k == kMostInternalSteps)
      return fails(std::to_string(k) + " internal steps lead only to " + at(before) +
                   (is_stiff_ ? "; take a shorter step, larger tolerances, or smoother forces"
                              : "; adaptive-stiff takes longer ones where something decays fast"));
    const Cvodes::Outcome outcome = solver.advance();
    if (ends_here(before, solver.s(), length)) return fails(Cvodes::Outcome::kNoRate, solver.s());
    if (outcome != Cvodes::Outcome::kAdvanced) return fails(outcome, solver.s());
    ++problem_.effort.internal_steps;
    if (to_events && !find_event(solver, before)) return false;
    if (at_node_ && &solver == &solver_ && !tell_nodes(solver, before)) return false;
    if (to_events && event_) return true;
    y_ = Eigen::Map<const VectorXd>(solver.y(), problem_.n_y());
    if (solver.s() != length && problem_.longest_turn(y_.data()) > kLongTurn && !move_centre(solver, length))
      return false;
  }
  solver.read_sensitivities();
  return true;
}

// With a first step whose error by a method of order one, h^2 |y''| / 2, is about half of what is allowed.
bool AdaptiveSteps::start(Cvodes& solver, double end) {
  constexpr double kNear = 1e-6, kPart = 0.1;
  const double s = solver.s(), left = end - s, near = kNear * left;
  if (!problem_.rate(s, y_.data(), f_.data())) return has_no_value("the accelerations", s);
  double first = kPart * std::abs(left);
  errors_ = y_ + near * f_;
  if (problem_.rate(s + near, errors_.data(), f_later_.data())) {
    problem_.allowed_errors(y_.data(), errors_.data());
    const double bend = ((f_later_ - f_) / near).cwiseQuotient(errors_).norm() / std::sqrt(double(y_.size()));
    if (bend > 0) first = std::min(first, 1 / std::sqrt(bend));
  }
  solver.start(end, std::copysign(first, left));
  return true;
}

// To where the solver is; it begins anew.
bool AdaptiveSteps::move_centre(Cvodes& solver, double end) {
  const double s = solver.s();
  if (!problem_.state(s, y_.data(), x_.data())) return has_no_value("the state", s);
  if (solver.sensitivities().cols() > 0) {
    if (!problem_.frame(s, y_.data())) return has_no_value("the frame", s);
    solver.read_sensitivities();
    problem_.turn(solver.sensitivities());
  }
  problem_.move_centre(x_.data());
  y_.head(y_.size() / 2).setZero();
  solver.begin(s, y_.data());
  return start(solver, end);
}

// In the last internal step, up to an event; false where there is no state.
bool AdaptiveSteps::tell_nodes(Cvodes& solver, double from) {
  const double length = (event_ ? length_ : solver.s()) - from;
  const auto tell = [&](const auto& points, const auto& weights) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (const double side : {-1.0, 1.0}) {
        if (points[i] == 0 && side > 0) continue;
        const double s = from + length * (1 + side * points[i]) / 2;
        solver.at(s, errors_.data());
        if (!problem_.state(s, errors_.data(), x_.data())) return has_no_value("the state", s);
        at_node_(x_.data(), weights[i] * length / 2);
      }
    }
    return true;
  };
  using Three = std::array<double, 2>;
  using Seven = boost::math::quadrature::gauss<double, 7>;
  if (solver.order() <= 3) return tell(Three{0, 0.77459666924148338}, Three{8. / 9, 5. / 9});
  return tell(Seven::abscissa(), Seven::weights());
}

// In the last internal step; false where the events have no value.
bool AdaptiveSteps::find_event(Cvodes& solver, double from) {
  const double to = solver.s();
  double before = from;
  for (int k = 1; k <= kLooks; ++k) {
    const double s = k == kLooks ? to : from + (to - from) * k / kLooks;
    if (!look_at_events(solver, s)) return false;
    if (fallen() >= 0) return narrow(solver, before, s);
    for (Eigen::Index i = 0; i < problem_.n_g(); ++i) was_above_[std::size_t(i)] = problem_.g()[i] > 0;
    before = s;
  }
  return true;
}

// An entry has fallen at `after`, and none before.
bool AdaptiveSteps::narrow(Cvodes& solver, double before, double after) {
  const double unit = std::numeric_limits<double>::epsilon() / 2;
  while (std::abs(after - before) > unit * std::max(std::abs(t_), std::abs(after))) {
    const double middle = before + (after - before) / 2;
    if (middle == before || middle == after) break;
    if (!look_at_events(solver, middle)) return false;
    (fallen() >= 0 ? after : before) = middle;
  }
  if (!look_at_events(solver, after)) return false;
  event_ = {fallen(), t_ + after};
  length_ = after;
  return true;
}

bool AdaptiveSteps::look_at_events(Cvodes& solver, double s) {
  solver.at(s, y_.data());
  if (!problem_.state(s, y_.data(), x_.data())) return has_no_value("the state", s);
  return problem_.events(s, x_.data()) || has_no_value("the events", s);
}

int AdaptiveSteps::fallen() const {
  for (Eigen::Index i = 0; i < problem_.n_g(); ++i)
    if (was_above_[std::size_t(i)] && problem_.g()[i] <= 0) return int(i);
  return -1;
}

// Whether the motion creeps up to where it has no rate: each internal step ends before it, and none beyond.  A try that
// was too long, or a guess of Newton's method, may have been refused where others lead.
bool AdaptiveSteps::ends_here(double before, double s, double end) const {
  constexpr double kNoDistance = 1e-12;
  const std::optional<double> refused = problem_.refused_at();
  if (!refused || s == end) return false;
  const double ahead = (*refused - s) * (end < 0 ? -1 : 1);
  return (ahead > 0 || s == before) && std::abs(ahead) <= kNoDistance * std::abs(end);
}

std::string AdaptiveSteps::at(double s) const { return "t = " + io::with_digits(t_ + s, 9) + " s"; }

bool AdaptiveSteps::fails(const std::string& why) {
  trouble_ = why;
  return false;
}

bool AdaptiveSteps::has_no_value(const char* what, double s) {
  const std::string branch = problem_.left_branch();
  return fails(branch.empty() ? what + std::string(" are not finite at ") + at(s) : branch);
}

bool AdaptiveSteps::fails(Cvodes::Outcome outcome, double s) {
  switch (outcome) {
    case Cvodes::Outcome::kNoRate:
      if (const std::string branch = problem_.left_branch(); !branch.empty()) return fails(branch);
      return fails(std::string(problem_.refused_slopes() ? "derivatives of " : "") +
                   "the accelerations are not finite beyond " + at(s) + ", however short the internal steps");
    case Cvodes::Outcome::kRough:
      return fails("beyond " + at(s) +
                   " the error stays above the tolerances, however short the internal steps; "
                   "take larger tolerances, or smoother forces");
    case Cvodes::Outcome::kUnsolved:
      return fails("beyond " + at(s) +
                   " the equations of an internal step have no solution, however short it is");
    case Cvodes::Outcome::kTooTight:
      return fails("at " + at(s) + " rounding is more than the tolerances allow; take larger ones");
    case Cvodes::Outcome::kAdvanced:
    case Cvodes::Outcome::kOther:
      break;
  }
  return fails("the integrator stopped at " + at(s));
}

}  // namespace dyntape
