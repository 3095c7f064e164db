// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/scheme.h>

#include <charconv>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>

namespace dyntape {

namespace {

struct Family {
  std::string prefix;
  const char* counts;
  Scheme (*of)(int);
};
const Family kFamilies[] = {{"lobatto-", "<points>", lobatto},
                            {"radau-", "<points>", radau},
                            {"pseudospectral-", "<points>", pseudospectral},
                            {"runge-kutta-4x", "<steps>", runge_kutta_4}};

}  // namespace

Eigen::VectorXd lagrange_weights(const Eigen::VectorXd& points, double at) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(points.size());
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    for (Eigen::Index j = 0; j < points.size(); ++j) {
      if (j != i) weights[i] *= (at - points[j]) / (points[i] - points[j]);
    }
  }
  return weights;
}

Eigen::VectorXd Scheme::control_weights(double fraction) const {
  const int first = uses_first_point() ? 0 : 1, used = points() - first - (uses_last_point() ? 0 : 1);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(points());
  weights.segment(first, used) = lagrange_weights(c.segment(first, used), fraction);
  return weights;
}

Problem Scheme::taken_by(const Problem& problem, const IntervalLength& length) const {
  return step ? multiple_shooting(problem, *step, steps, length) : problem;
}

std::string Scheme::fault_on(int intervals) const {
  if (!spans_all || intervals <= 1) return "";
  const std::string most = std::to_string(points());
  return "the scheme \"" + name + "\" is of one interval, got " + std::to_string(intervals) +
         ", on which its rows all but depend on each other; expected 1 interval and more points, or "
         "lobatto-" +
         most;
}

const std::vector<Scheme>& schemes() {
  static const std::vector<Scheme> all = [] {
    std::vector<Scheme> rows = {
        {"euler", Eigen::VectorXd{{0, 1}}, Eigen::MatrixXd{{-1, 1}}, Eigen::MatrixXd{{-1, 0}},
         Eigen::VectorXd{{1, 0}}, 1},
        {"trapezoid", Eigen::VectorXd{{0, 1}}, Eigen::MatrixXd{{-1, 1}}, Eigen::MatrixXd{{-0.5, -0.5}},
         Eigen::VectorXd{{0.5, 0.5}}, 2},
        {"hermite-simpson", Eigen::VectorXd{{0, 0.5, 1}}, Eigen::MatrixXd{{-0.5, 1, -0.5}, {-1, 0, 1}},
         Eigen::MatrixXd{{-0.125, 0, 0.125}, {-1. / 6, -4. / 6, -1. / 6}},
         Eigen::VectorXd{{1. / 6, 4. / 6, 1. / 6}}, 4}};
    const auto like = [&rows](Scheme row, const char* name, int order) {
      row.name = name, row.order = order;
      rows.push_back(row);
      return &rows.back();
    };
    like(rows[2], "hermite-simpson-linear", 4)->held = Eigen::MatrixXd{{-0.5, 1, -0.5}};
    like(rows[0], "runge-kutta-4", 4)->step = ShootingScheme::kRungeKutta4;
    like(rows[0], "semi-implicit-euler", 1)->step = ShootingScheme::kEuler;
    return rows;
  }();
  return all;
}

Scheme euler() { return scheme_by_name("euler"); }
Scheme trapezoid() { return scheme_by_name("trapezoid"); }
Scheme hermite_simpson() { return scheme_by_name("hermite-simpson"); }

Scheme runge_kutta_4(int steps) {
  const std::string name = "runge-kutta-4x" + std::to_string(steps);
  if (steps < 1 || steps > 128)
    throw ArgumentError("there is no scheme \"" + name + "\": expected 1 to 128 steps");
  Scheme scheme = scheme_by_name("runge-kutta-4");
  scheme.name = name, scheme.steps = steps;
  return scheme;
}

std::vector<std::string> scheme_names() {
  std::vector<std::string> names;
  for (const Scheme& scheme : schemes()) names.push_back(scheme.name);
  for (const Family& family : kFamilies) names.push_back(family.prefix + family.counts);
  return names;
}

std::string listed_schemes() {
  std::string all;
  for (const std::string& name : scheme_names()) all += (all.empty() ? "" : ", ") + name;
  return all;
}

Scheme scheme_by_name(const std::string& name) {
  std::vector<std::string> likely;
  for (const Scheme& scheme : schemes()) {
    if (scheme.name == name) return scheme;
    likely.push_back(scheme.name);
  }
  const std::size_t digits = name.find_last_not_of("0123456789") + 1;  // of the number that it ends with
  for (const auto& [prefix, counts, of] : kFamilies) {
    int points = 0;
    const auto [end, error] = std::from_chars(name.data() + digits, name.data() + name.size(), points);
    const bool is_number = error == std::errc() && end == name.data() + name.size();
    if (is_number && name.compare(0, digits, prefix) == 0) return of(points);
    likely.push_back(prefix + (is_number ? name.substr(digits) : "5"));
  }
  const std::string near = nearest_name(name, likely);
  throw ArgumentError("there is no scheme \"" + name + "\"; the schemes are " + listed_schemes() +
                      (near.empty() ? "" : "; did you mean '" + near + "'?"));
}

}  // namespace dyntape
