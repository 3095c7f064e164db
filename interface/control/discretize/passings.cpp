// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/passings.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

constexpr int kLooksBetween = 8;        // from one point of the mesh to the next
constexpr int kNarrowings = 12;         // of the bracket around an extremum
constexpr double kLeastMovement = 0.5;  // in an interval, of the movement in the whole motion
constexpr double kOfJumps = 5;  // of the movement of controls, which polynomials overshoot where these jump
constexpr double kWidened =
    1e-6;  // of a limit or half its range: what solvers widen bounds by, and their tolerance

double movement(const Eigen::Ref<const VectorXd>& values) { return values.maxCoeff() - values.minCoeff(); }

// How far each variable moves in an interval, but no less than a part of `whole`.
VectorXd movements(const Eigen::MatrixXd& of_interval, const VectorXd& whole) {
  VectorXd moved(whole.size());
  for (Eigen::Index i = 0; i < moved.size(); ++i)
    moved[i] = std::max(movement(of_interval.row(i).transpose()), kLeastMovement * whole[i]);
  return moved;
}

VectorXd whole_movements(const Eigen::MatrixXd& values) {
  VectorXd moved(values.rows());
  for (Eigen::Index i = 0; i < moved.size(); ++i) moved[i] = movement(values.row(i).transpose());
  return moved;
}

double beyond(double value, double lower, double upper) { return std::max(lower - value, value - upper); }

bool is_counted(double by, double limit, double lower, double upper) {
  const double half_range = std::isfinite(upper - lower) ? (upper - lower) / 2 : 0;
  return by > kWidened * std::max({std::abs(limit), half_range, kWidened});
}

class Search {
 public:
  Search(const Problem& problem, const Trajectory& motion, const VectorXd& extents)
      : problem_(problem), motion_(motion), between_(problem, motion), of_states_(extents) {
    Trajectory used = motion;
    used.extend_to_unused();
    x_ = used.x, a_ = used.a, u_ = used.u;
    of_accelerations_ = whole_movements(a_), of_controls_ = whole_movements(u_);
  }

  Passings run() {
    found_.of_intervals.setZero(motion_.intervals());
    look_everywhere();
    for (int i = 0; i < problem_.n_x(); ++i)
      search_variable(problem_.states[std::size_t(i)], problem_.x, i, Part::kState);
    for (int i = 0; i < problem_.n_a(); ++i)
      search_variable(problem_.accelerations[std::size_t(i)], problem_.a, i, Part::kAcceleration);
    if (motion_.u_lower.size() == 0)  // else polynomials are cut at the limits of controls
      for (int i = 0; i < problem_.n_u(); ++i)
        search_variable(problem_.controls[std::size_t(i)], problem_.u, i, Part::kControl);
    for (const Term& term : problem_.terms)
      if (term.role == Role::kInequality && term.where == Where::kRunning) search_term(term);
    const auto worse = [](const Passing& a, const Passing& b) { return a.excess > b.excess; };
    std::stable_sort(found_.rows.begin(), found_.rows.end(), worse);
    return std::move(found_);
  }

 private:
  enum class Part { kState, kAcceleration, kControl };
  struct Place {
    int point;
    double fraction;
  };
  using Value = std::function<double(const Stage<double>&)>;

  bool has_rows() const {
    const auto bounded = [](const Bounds& b) {
      return (b.lower.array() > -HUGE_VAL).any() || (b.upper.array() < HUGE_VAL).any();
    };
    return bounded(problem_.x) || bounded(problem_.a) || bounded(problem_.u) ||
           std::any_of(problem_.terms.begin(), problem_.terms.end(), [](const Term& t) {
             return t.role == Role::kInequality && t.where == Where::kRunning;
           });
  }

  void look_everywhere() {
    if (!has_rows()) return;
    for (int p = 0; p + 1 < motion_.points(); ++p) {
      for (int i = 1; i < kLooksBetween; ++i) {
        places_.push_back({p, double(i) / kLooksBetween});
        stages_.push_back(between_.at(p, places_.back().fraction));
      }
    }
  }

  static const VectorXd& part_of(const Stage<double>& s, Part part) {
    return part == Part::kState ? s.x : part == Part::kAcceleration ? s.a : s.u;
  }

  void search_variable(const std::string& name, const Bounds& bounds, int i, Part part) {
    const double lower = bounds.lower[i], upper = bounds.upper[i];
    if (lower == -HUGE_VAL && upper == HUGE_VAL) return;
    std::vector<double> values;
    values.reserve(stages_.size());
    for (const Stage<double>& s : stages_) values.push_back(part_of(s, part)[i]);
    const Value value = [&](const Stage<double>& s) { return part_of(s, part)[i]; };
    const auto size = [&](const Place&) {
      if (part == Part::kState) return of_states_[i];
      if (part == Part::kAcceleration) return of_accelerations_[i];
      const double range = upper - lower;
      return std::isfinite(range) ? std::max(range, of_controls_[i]) : of_controls_[i];
    };
    search(name, values, value, lower, upper, size);
  }

  void search_term(const Term& term) {
    std::vector<VectorXd> rows;
    rows.reserve(stages_.size());
    for (const Stage<double>& s : stages_) rows.push_back(term.function(s));
    for (Eigen::Index r = 0; r < term.lower.size(); ++r) {
      std::vector<double> values;
      values.reserve(rows.size());
      for (const VectorXd& row : rows) values.push_back(row[r]);
      const std::string index = term.lower.size() > 1 ? "[" + std::to_string(r) + "]" : "";
      const Value value = [&](const Stage<double>& s) { return term.function(s)[r]; };
      search(term.name + index, values, value, term.lower[r], term.upper[r],
             [&](const Place& at) { return term.length > 0 ? term.length : change_by_movements(value, at); });
    }
  }

  // |g'| with variables in units of their movements, by central differences.
  double change_by_movements(const Value& value, const Place& at) const {
    constexpr double kStep = 1e-4;  // of a movement
    Stage<double> s = between_.at(at.point, at.fraction);
    const int k = interval_of(at);
    double squares = 0;
    const auto add = [&](VectorXd& part, const VectorXd& moved) {
      for (Eigen::Index i = 0; i < part.size(); ++i) {
        const double before = part[i], h = kStep * moved[i];
        if (!(h > 0)) continue;
        part[i] = before + h;
        const double above = value(s);
        part[i] = before - h;
        const double below = value(s);
        part[i] = before;
        if (std::isfinite(above - below)) squares += std::pow((above - below) / (2 * kStep), 2);
      }
    };
    add(s.x, movements(of_interval(x_, k), of_states_));
    add(s.a, kOfJumps * of_accelerations_);
    add(s.u, kOfJumps * of_controls_);
    return std::sqrt(squares);
  }

  Eigen::MatrixXd of_interval(const Eigen::MatrixXd& values, int k) const {
    return values.middleCols(motion_.node(k), motion_.scheme.points());
  }
  int interval_of(const Place& at) const { return at.point / (motion_.scheme.points() - 1); }

  // The worst places of each interval are measured, because the measure is the interval's own.
  template <class Size>
  void search(const std::string& name, const std::vector<double>& values, const Value& value, double lower,
              double upper, const Size& size) {
    std::optional<Passing> worst;
    const std::size_t of_interval = std::size_t(kLooksBetween - 1) * std::size_t(motion_.scheme.points() - 1);
    for (std::size_t first = 0; first < values.size(); first += of_interval) {
      std::size_t most = first;
      for (std::size_t i = first; i < std::min(first + of_interval, values.size()); ++i)
        if (beyond(values[i], lower, upper) > beyond(values[most], lower, upper)) most = i;
      if (!(beyond(values[most], lower, upper) > -change_beside(values, most))) continue;
      const Place at = extremum(places_[most], value, lower, upper);
      const Stage<double> s = between_.at(at.point, at.fraction);
      const double g = value(s), by = beyond(g, lower, upper), limit = g > upper ? upper : lower;
      if (!(by > 0) || !is_counted(by, limit, lower, upper)) continue;
      const double excess = by / size(at);
      double& most_of_interval = found_.of_intervals[interval_of(at)];
      most_of_interval = std::max(most_of_interval, excess);
      if (!worst || excess > worst->excess) worst = {name, g, limit, s.t, interval_of(at), excess};
    }
    if (worst) found_.rows.push_back(*worst);
  }

  // How far beyond a look the values may go until the next: so much they change from one look to another.
  static double change_beside(const std::vector<double>& values, std::size_t at) {
    double change = 0;
    if (at > 0) change = std::max(change, std::abs(values[at] - values[at - 1]));
    if (at + 1 < values.size()) change = std::max(change, std::abs(values[at + 1] - values[at]));
    return change;
  }

  // Golden section between the neighbours of a look.
  Place extremum(const Place& look, const Value& value, double lower, double upper) const {
    constexpr double kGolden = 0.6180339887498949;
    double a = look.fraction - 1.0 / kLooksBetween, b = look.fraction + 1.0 / kLooksBetween;
    const auto at = [&](double f) { return beyond(value(between_.at(look.point, f)), lower, upper); };
    double c = b - kGolden * (b - a), d = a + kGolden * (b - a), at_c = at(c), at_d = at(d);
    for (int i = 0; i < kNarrowings; ++i) {
      if (at_c > at_d)
        b = d, d = c, at_d = at_c, c = b - kGolden * (b - a), at_c = at(c);
      else
        a = c, c = d, at_c = at_d, d = a + kGolden * (b - a), at_d = at(d);
    }
    const double found = (a + b) / 2;
    return {look.point, at(found) > at(look.fraction) ? found : look.fraction};
  }

  const Problem& problem_;
  const Trajectory& motion_;
  const MotionBetween between_;
  const VectorXd of_states_;
  VectorXd of_accelerations_, of_controls_;
  Eigen::MatrixXd x_, a_, u_;  // of all points
  std::vector<Place> places_;
  std::vector<Stage<double>> stages_;
  Passings found_;
};

}  // namespace

std::string Passing::text() const {
  return name + " is " + io::with_digits(value, 6) + " at " + io::with_digits(time, 6) +
         " s, between points of the mesh, bounded by " + io::with_digits(limit, 6);
}

Passings find_passings(const Problem& problem, const Trajectory& motion, const VectorXd& extents) {
  return Search(problem, motion, extents).run();
}

}  // namespace dyntape
