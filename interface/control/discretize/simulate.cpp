// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/problem/dormand_prince.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using dormand_prince::kStages;
using Eigen::VectorXd;

constexpr int kMostSteps = 200000;
constexpr int kLeastSteps = 16;  // however smooth a motion looks: long steps look past what is short
constexpr double kMostGrowth = 6, kMostShrinking = 1.0 / 3, kSafety = 0.9;  // of the step

using Rate = std::function<VectorXd(double t, const VectorXd& x)>;

// Of a step's error.  A cost, where there is one, is the last entry of x.
struct Tolerance {
  double of_states;  // relative to 1 + |x|
  const RunningCost* cost;
  Eigen::ArrayXd allowed(const Eigen::ArrayXd& sizes) const {
    Eigen::ArrayXd all = of_states * (1 + sizes);
    if (cost) all[all.size() - 1] = cost->tolerance;
    return all;
  }
};
using Slopes = Eigen::Matrix<double, Eigen::Dynamic, kStages>;

Eigen::Map<const Eigen::Matrix<double, kStages, 1>> weights(const dormand_prince::Row& row) {
  return Eigen::Map<const Eigen::Matrix<double, kStages, 1>>(row.data());
}

struct Step {
  VectorXd x;
  double error;  // in units of what is allowed; not finite where a stage is not
};

// A step of length h from x, where the rate is `slope`.
Step step(const Rate& rate, double t, const VectorXd& x, const VectorXd& slope, double h,
          const Tolerance& tolerance) {
  Slopes k = Slopes::Zero(x.size(), kStages);
  k.col(0) = slope;
  for (int i = 1; i < kStages; ++i) {
    k.col(i) = rate(t + dormand_prince::c[i] * h, x + h * (k * weights(dormand_prince::a[i])));
  }
  const VectorXd end = x + h * (k * weights(dormand_prince::b));
  const Eigen::ArrayXd allowed = tolerance.allowed(x.array().abs().max(end.array().abs()));
  const auto squared = [&](const dormand_prince::Row& row) {
    return ((k * weights(row)).array() / allowed).square().sum() / double(x.size());
  };
  const double fifth = squared(dormand_prince::e5), third = squared(dormand_prince::e3);
  const double error = fifth == 0 ? fifth : h * fifth / std::sqrt(fifth + 0.01 * third);
  return {end, end.allFinite() ? error : std::nan("")};
}

// A first step that neither x nor its slope outgrow; of those authors, section II.4.
double first_step(const Rate& rate, double t, const VectorXd& x, const VectorXd& slope, double most,
                  const Tolerance& tolerance) {
  const auto norm = [&](const VectorXd& v) {
    return std::sqrt((v.array() / tolerance.allowed(x.array().abs())).square().mean());
  };
  const double size = norm(x), speed = norm(slope);
  const bool known = size > 1e-5 && speed > 1e-5;
  const double look = known ? std::min(0.01 * size / speed, most) : 1e-3 * most;
  const double bend = norm(rate(t + look, x + look * slope) - slope) / look;
  return std::min({100 * look, std::pow(0.01 / std::max(speed, bend), 1.0 / 8), most});
}

// What the next step is of this one.
double growth(double error) {
  if (!(error < HUGE_VAL)) return kMostShrinking;
  return std::clamp(kSafety * std::pow(error, -1.0 / 8), kMostShrinking, kMostGrowth);
}

std::string at(double t) { return " at t = " + io::shortest(t) + " s"; }

// "x' of v is nan at t = 0.5 s" where an entry is not finite, or "".
std::string not_finite(const Problem& problem, const VectorXd& values, const char* what, double t) {
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    const bool is_cost = i == problem.n_x();
    return (is_cost ? "the running cost is " : what + ("\"" + problem.states[std::size_t(i)]) + "\" is ") +
           io::shortest(values[i]) + at(t);
  }
  return "";
}

VectorXd rate_of(const Problem& problem, double t, const VectorXd& x, const VectorXd& u) {
  VectorXd rate = problem.ode(problem.stage(t, x, {}, u));
  if (rate.size() == x.size()) return rate;
  refuse(problem, "the rate without accelerations has " + std::to_string(rate.size()) +
                      " entries, expected one a state: " + std::to_string(x.size()));
}

}  // namespace

Simulation simulate(const Problem& problem, VectorXd x, double from, double to,
                    const std::function<VectorXd(double t)>& control, double of_states,
                    const RunningCost* cost) {
  const Tolerance tolerance{of_states, cost};
  const Eigen::Index n = x.size();
  const Rate rate = [&](double t, const VectorXd& at) {
    const VectorXd u = control(t);
    if (!cost) return rate_of(problem, t, at, u);
    VectorXd all(n + 1);
    all << rate_of(problem, t, at.head(n), u), cost->rate(t, at.head(n), u);
    return all;
  };
  const auto broken = [&](std::string trouble) {
    return Simulation{VectorXd::Constant(n, std::nan("")), std::move(trouble), std::nan("")};
  };
  for (double time : {from, to}) {
    if (!std::isfinite(time)) return broken("an end is" + at(time));
  }
  if (std::string bad = not_finite(problem, x, "", from); !bad.empty()) return broken(bad);
  if (cost) x.conservativeResize(n + 1), x[n] = 0;
  const double smallest = 4 * std::numeric_limits<double>::epsilon() * std::max(std::abs(from), std::abs(to));
  const double most = std::max((to - from) / kLeastSteps, 2 * smallest);
  double t = from, h = 0;
  VectorXd slope = rate(t, x);
  if (t < to && slope.allFinite()) {
    h = std::max(first_step(rate, t, x, slope, most, tolerance), 2 * smallest);
  }
  for (int k = 0; t < to; ++k) {
    if (std::string bad = not_finite(problem, slope, "the rate of ", t); !bad.empty()) return broken(bad);
    if (k == kMostSteps) return broken(std::to_string(kMostSteps) + " steps are not enough" + at(t));
    const bool last = h >= to - t;
    h = last ? to - t : (t + h) - t;  // the step that t can take
    if (h <= smallest && !last) return broken("the steps vanish" + at(t));
    const Step next = step(rate, t, x, slope, h, tolerance);
    if (next.error <= 1) {
      t = last ? to : t + h;
      x = next.x;
      slope = rate(t, x);
    }
    h = std::min(h * growth(next.error), most);
  }
  return {x.head(n), "", cost ? x[n] : 0};
}

}  // namespace dyntape
