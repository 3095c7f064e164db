// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/verify.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <dyntape/interface/control/discretize/staged_nlp.h>

namespace dyntape {

namespace {

constexpr double kStill = 0.01;  // of its magnitude: what moves less stands still
constexpr double kNoMovement = 1e-9,
                 kFarAbove = 1e3;  // a motion in whose own units nothing is more says nothing of sizes
constexpr double kOfKind = 1e-4;   // of the largest of its kind, likewise
constexpr double kSimulated = 1e-12,
                 kSimulatedCost = 1e-9;  // of simulations, of the cost relative to its size
constexpr double kNoCost = 1e-6;  // of the nominal cost: errors of a cost that vanishes are measured by this

// "q." of "q.elbow"; of a name without a dot all of it.
std::string kind_of_state(const std::string& state) { return state.substr(0, state.find('.')); }

class Audit {
 public:
  Audit(const Problem& problem, const Trajectory& motion, const NlpScaling& scaling,
        const std::stop_token& stop)
      : problem_(problem),
        motion_(motion),
        units_(scaling),
        stop_(stop),
        taken_(motion.scheme.taken_by(problem, interval_lengths(motion.nodes()))),
        least_units_(least_units()) {}

  Verification run() {
    check_bounds();
    check_defects();
    check_held_controls();
    check_path();
    check_instants();
    check_units();
    simulate_intervals();
    simulate_whole();
    return std::move(result_);
  }

 private:
  // Notes by how many units a value lies outside [lower, upper].
  void note(double value, double lower, double upper, double unit, const std::string& what) {
    const double excess = std::isnan(value) ? value : std::max({0.0, lower - value, value - upper}) / unit;
    if (excess <= result_.violation || std::isnan(result_.violation)) return;
    result_.violation = excess;
    result_.worst_row = what;
  }

  // The same of the next row of the program, in its order.
  void note_row(double value, double lower, double upper, const std::string& what, double least_unit = 0) {
    note(value, lower, upper, row_ < units_.g.size() ? std::max(units_.g[row_], least_unit) : 1, what);
    ++row_;
  }

  // (n_x) Of a state that only rounding moves what is rounding as well would be a violation.
  Eigen::VectorXd least_units() const {
    Eigen::VectorXd least = Eigen::VectorXd::Zero(problem_.n_x());
    if (units_.x.size() < std::size_t(problem_.n_x())) return least;
    std::map<std::string, double> largest;  // of a kind
    for (int i = 0; i < problem_.n_x(); ++i) {
      double& most = largest[kind_of_state(problem_.states[std::size_t(i)])];
      most = std::max(most, units_.x[std::size_t(i)]);
    }
    for (int i = 0; i < problem_.n_x(); ++i)
      least[i] = kOfKind * largest[kind_of_state(problem_.states[std::size_t(i)])];
    return least;
  }

  // Of entry i of point p: x, then a, then u.
  double unit(int p, Eigen::Index i) const {
    const Eigen::Index n_z = problem_.n_x() + problem_.n_a() + problem_.n_u();
    const auto variable = static_cast<std::size_t>(p * n_z + i);
    if (variable >= units_.x.size()) return 1;
    return i < problem_.n_x() ? std::max(units_.x[variable], least_units_[i]) : units_.x[variable];
  }

  void check_units() const {
    const Eigen::Index n = motion_.x.size() + motion_.a.size() + motion_.u.size();
    const bool fit_x = units_.x.empty() || units_.x.size() == static_cast<std::size_t>(n);
    if (fit_x && (units_.g.empty() || units_.g.size() == row_)) return;
    refuse(problem_, "nominal values of " + std::to_string(units_.x.size()) + " variables and " +
                         std::to_string(units_.g.size()) + " rows, the motion has " + std::to_string(n) +
                         " and " + std::to_string(row_));
  }

  Stage<double> stage(int p) const {
    return taken_.stage(motion_.t[p], motion_.x.col(p), motion_.a.col(p), motion_.u.col(p));
  }

  bool used(int p) const {
    return (p > 0 || motion_.scheme.uses_first_point()) &&
           (p + 1 < motion_.points() || motion_.scheme.uses_last_point());
  }

  std::string at(const std::string& what, int p) const { return what + " at point " + std::to_string(p); }

  void check_part(const Bounds& bounds, const Eigen::MatrixXd& values, const std::vector<std::string>& names,
                  int first, bool all_count) {
    for (int p = 0; p < motion_.points(); ++p) {
      if (!all_count && !used(p)) continue;
      for (Eigen::Index i = 0; i < values.rows(); ++i) {
        note(values(i, p), bounds.lower[i], bounds.upper[i], unit(p, first + i),
             at(names[std::size_t(i)], p));
      }
    }
  }

  void check_bounds() {
    check_part(problem_.x, motion_.x, problem_.states, 0, true);
    check_part(problem_.a, motion_.a, problem_.accelerations, problem_.n_x(), false);
    check_part(problem_.u, motion_.u, problem_.controls, problem_.n_x() + problem_.n_a(), false);
    const int last = motion_.points() - 1;
    if (problem_.free_time) {
      const auto [shortest, longest] = *problem_.free_time;
      note(motion_.t[last], shortest, longest, problem_.duration, "the duration");
    }
    for (int i = 0; i < problem_.n_x(); ++i) {
      const double start = problem_.start[i], goal = problem_.goal[i];
      const std::string& name = problem_.states[std::size_t(i)];
      if (!std::isnan(start)) note(motion_.x(i, 0), start, start, unit(0, i), name + " at the start");
      if (!std::isnan(goal)) note(motion_.x(i, last), goal, goal, unit(last, i), name + " at the end");
    }
  }

  Eigen::MatrixXd rates_of_points() {
    Eigen::MatrixXd rates = Eigen::MatrixXd::Zero(problem_.n_x(), motion_.points());
    for (int p = 0; p < motion_.points(); ++p) {
      if (used(p)) rates.col(p) = taken_.rate(stage(p));
    }
    return rates;
  }

  void check_defects() {
    const Eigen::MatrixXd rates = rates_of_points();
    const Scheme& scheme = motion_.scheme;
    for (int k = 0; k < motion_.intervals(); ++k) {
      const int first = motion_.node(k);
      const double h = motion_.t[motion_.node(k + 1)] - motion_.t[first];
      const Eigen::MatrixXd defect = motion_.x.middleCols(first, scheme.points()) * scheme.alpha.transpose() +
                                     h * rates.middleCols(first, scheme.points()) * scheme.beta.transpose();
      for (Eigen::Index r = 0; r < defect.cols(); ++r) {
        for (int i = 0; i < problem_.n_x(); ++i) {
          note_row(defect(i, r), 0, 0,
                   "defect of " + problem_.states[std::size_t(i)] + " in interval " + std::to_string(k),
                   least_units_[i]);
        }
      }
    }
  }

  void check_held_controls() {
    const Scheme& scheme = motion_.scheme;
    for (int k = 0; k < motion_.intervals(); ++k) {
      const Eigen::MatrixXd controls = motion_.u.middleCols(motion_.node(k), scheme.points());
      for (Eigen::Index r = 0; r < scheme.held.rows(); ++r) {
        for (int i = 0; i < problem_.n_u(); ++i) {
          note_row(scheme.held.row(r).dot(controls.row(i)), 0, 0,
                   "course of " + problem_.controls[std::size_t(i)] + " in interval " + std::to_string(k));
        }
      }
    }
  }

  static double cost_of(const Term& term, const Eigen::VectorXd& r) {
    return term.role == Role::kCost ? r[0] : term.role == Role::kSquares ? r.squaredNorm() : 0;
  }

  void add_term(const Term& term, const Stage<double>& s, double weight, const std::string& where) {
    const Eigen::VectorXd r = term.function(s);
    const double cost = weight * cost_of(term, r);
    result_.cost += cost, magnitude_ += std::abs(cost);
    if (term.where != Where::kRunning) of_instants_ += cost;
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      if (term.role == Role::kEquality) note_row(r[i], 0, 0, where);
      if (term.role == Role::kInequality) note_row(r[i], term.lower[i], term.upper[i], where);
    }
  }

  void check_path() {
    const Scheme& scheme = motion_.scheme;
    Eigen::VectorXd quadrature = Eigen::VectorXd::Zero(motion_.points());
    running_ = Eigen::VectorXd::Zero(motion_.points());
    for (int k = 0; k < motion_.intervals(); ++k) {
      const double h = motion_.t[motion_.node(k + 1)] - motion_.t[motion_.node(k)];
      quadrature.segment(motion_.node(k), scheme.points()) += h * scheme.gamma;
    }
    for (int p = 0; p < motion_.points(); ++p) {
      if (!used(p)) continue;
      const Stage<double> s = stage(p);
      if (!problem_.residual.empty()) {
        for (double r : problem_.residual(s)) note_row(r, 0, 0, at("dynamics", p));
      }
      for (const Term& term : taken_.terms) {
        if (term.where != Where::kRunning) continue;
        add_term(term, s, quadrature[p], at(term.name, p));
        if (!is_constraint(term.role)) running_[p] += cost_of(term, term.function(s));
      }
    }
  }

  void check_instants() {
    const std::vector<double> nodes = motion_.nodes();
    const bool has_times = std::isfinite(nodes.back());  // a solve may leave a duration that is no number
    for (double share : instants_of(problem_)) {
      const std::size_t node = has_times ? node_at_share(problem_, share, nodes) : nodes.size() - 1;
      const Stage<double> s = stage(motion_.node(int(node)));
      for (const Term& term : taken_.terms) {
        if (stands_at(term, share)) add_term(term, s, 1, term.name + " at " + name_of_instant(share));
      }
    }
  }

  Simulation simulate_interval(int k, const Eigen::VectorXd& from, const RunningCost* cost) const {
    const double begin = motion_.t[motion_.node(k)], end = motion_.t[motion_.node(k + 1)];
    // A control that is no number ends a simulation at once.
    return simulate(
        problem_, from, begin, end,
        [&](double t) {
          Eigen::VectorXd u = motion_.control(k, (t - begin) / (end - begin));
          if (stop_.stop_requested()) u.setConstant(std::nan(""));
          return u;
        },
        kSimulated, cost);
  }

  Simulation until_stopped(int k, const Eigen::VectorXd& from, const RunningCost* cost = nullptr) const {
    Simulation end = stop_.stop_requested() ? Simulation{} : simulate_interval(k, from, cost);
    if (!stop_.stop_requested()) return end;
    return {Eigen::VectorXd::Constant(from.size(), std::nan("")), "the simulation was interrupted"};
  }

  // Notes the interval if it is off by most so far; a state that is no number is off by more than any.
  void note_defect(int k, const Eigen::VectorXd& defect, const Eigen::VectorXd& extents) {
    Eigen::Index state = 0;
    const double most = defect.cwiseQuotient(extents).maxCoeff<Eigen::PropagateNaN>(&state);
    result_.relative_defect[k] = most;
    if (most <= result_.worst_relative || std::isnan(result_.worst_relative)) return;
    result_.worst_relative = most;
    result_.worst_interval = k;
    result_.worst_state = problem_.states[std::size_t(state)];
    result_.worst_state_defect = defect[state];
  }

  // What the scheme makes of the running costs of an interval.
  double quadrature_of(int k) const {
    const double h = motion_.t[motion_.node(k + 1)] - motion_.t[motion_.node(k)];
    return h * running_.segment(motion_.node(k), motion_.scheme.points()).dot(motion_.scheme.gamma);
  }

  // The running costs of the problem, with the accelerations of the motion.
  RunningCost running_cost(int k) const {
    const double begin = motion_.t[motion_.node(k)], end = motion_.t[motion_.node(k + 1)];
    return {[this, k, begin, end](double t, const Eigen::VectorXd& x, const Eigen::VectorXd& u) {
              const Stage<double> s =
                  problem_.stage(t, x, motion_.acceleration(k, (t - begin) / (end - begin)), u);
              double sum = 0;
              for (const Term& term : problem_.terms)
                if (term.where == Where::kRunning && !is_constraint(term.role))
                  sum += cost_of(term, term.function(s));
              return sum;
            },
            kSimulatedCost * size_of_cost()};
  }
  bool has_running_cost() const {
    return std::any_of(problem_.terms.begin(), problem_.terms.end(), [](const Term& term) {
      return term.where == Where::kRunning && !is_constraint(term.role);
    });
  }

  // What the error of the cost is measured by.  Of a cost that vanishes the program's nominal value says what is little.
  double size_of_cost() const {
    return std::max({magnitude_, kNoCost * std::abs(units_.objective), std::numeric_limits<double>::min()});
  }

  void simulate_intervals() {
    result_.integration_error.resize(motion_.intervals());
    result_.relative_defect.resize(motion_.intervals());
    result_.cost_errors.setZero(motion_.intervals());
    const bool has_cost = has_running_cost();
    double true_cost = of_instants_;
    const Eigen::VectorXd extents = extents_of(problem_, motion_, units_);
    for (int k = 0; k < motion_.intervals(); ++k) {
      const RunningCost cost = running_cost(k);
      const Simulation end = until_stopped(k, motion_.x.col(motion_.node(k)), has_cost ? &cost : nullptr);
      if (has_cost) true_cost += end.cost, result_.cost_errors[k] = end.cost - quadrature_of(k);
      result_.integration_error[k] = distance(end.x, motion_.node(k + 1));
      note_defect(k, (end.x - motion_.x.col(motion_.node(k + 1))).cwiseAbs(), extents);
      if (result_.trouble.empty() && !end.trouble.empty()) {
        result_.trouble = "interval " + std::to_string(k) + ": " + end.trouble;
      }
    }
    result_.worst_defect = result_.integration_error.maxCoeff<Eigen::PropagateNaN>();
    result_.true_cost = true_cost;
    const double size = std::max(size_of_cost(), std::abs(true_cost));
    result_.cost_size = size, result_.cost_errors /= size;
    result_.cost_error = std::abs(result_.cost_errors.sum());
    if (result_.trouble.empty()) result_.passings = find_passings(problem_, motion_, extents);
  }

  void simulate_whole() {
    Eigen::VectorXd x = motion_.x.col(0);
    for (int k = 0; k < motion_.intervals() && !x.hasNaN(); ++k) x = until_stopped(k, x).x;
    Eigen::Index state = 0;
    result_.miss = (x - motion_.x.rightCols(1)).cwiseAbs().maxCoeff<Eigen::PropagateNaN>(&state);
    if (x.size() > 0)
      result_.miss_state = problem_.states[std::size_t(state)], result_.miss_index = int(state);
  }

  double distance(const Eigen::VectorXd& x, int p) const {
    return (x - motion_.x.col(p)).cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  }

  const Problem& problem_;
  const Trajectory& motion_;
  const NlpScaling& units_;
  const std::stop_token& stop_;
  const Problem taken_;  // by the scheme
  const Eigen::VectorXd least_units_;
  std::size_t row_ = 0;                     // of the program, the next to be noted
  Eigen::VectorXd running_;                 // (points) the running costs
  double magnitude_ = 0, of_instants_ = 0;  // of all costs; the costs of instants
  Verification result_;
};

}  // namespace

Eigen::VectorXd extents_of(const Problem& problem, const Trajectory& motion, const NlpScaling& scaling) {
  const double largest_x = motion.x.size() > 0 ? motion.x.cwiseAbs().maxCoeff() : 0;
  Eigen::VectorXd extents = motion.x.rowwise().maxCoeff() - motion.x.rowwise().minCoeff();
  std::map<std::string, double> largest;  // of a kind
  for (Eigen::Index i = 0; i < extents.size(); ++i) {
    double& most = largest[kind_of_state(problem.states[std::size_t(i)])];
    most = std::max(most, extents[i]);
  }
  for (Eigen::Index i = 0; i < extents.size(); ++i) {
    const double of_kind = largest[kind_of_state(problem.states[std::size_t(i)])];
    const double unit = std::size_t(i) < scaling.x.size() ? scaling.x[std::size_t(i)] : 1;
    // A nominal value far above all numbers of the motion says nothing of it.
    const double size = largest_x > kNoMovement ? std::min(unit, kFarAbove * largest_x) : unit;
    extents[i] = std::max({extents[i], kStill * size, kOfKind * of_kind});
  }
  return extents;
}

Verification verify(const Problem& problem, const Trajectory& motion, const NlpScaling& scaling,
                    const std::stop_token& stop) {
  return Audit(problem, motion, scaling, stop).run();
}

}  // namespace dyntape
