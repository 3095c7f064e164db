// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/problem/multiple_shooting.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace dyntape {

namespace {

template <class T>
using StageVector = typename Stage<T>::Vector;

// The steps of an interval, in any scalar.
class Steps {
 public:
  Steps(const Problem& problem, ShootingScheme scheme, int steps)
      : problem_(std::make_shared<const Problem>(problem)),
        scheme_(scheme),
        steps_(steps),
        n_x_(problem.n_x()),
        n_p_(problem.parameters.size()) {}

  const Problem& problem() const { return *problem_; }

  // What is asked for at a stage that has such a share of the interval.
  template <class T>
  using Look = std::function<void(const Stage<T>& stage, double share)>;

  // (x' - x) / h; every stage at which running costs count is looked at on the way.
  template <class T>
  StageVector<T> operator()(const Stage<T>& s, const Look<T>& look = {}) const {
    const T h = s.p[n_p_] / T(steps_);
    StageVector<T> x = s.x, sum = StageVector<T>::Constant(n_x_, T(0));
    for (int k = 0; k < steps_; ++k) {
      const StageVector<T> slope = scheme_ == ShootingScheme::kEuler ? of_euler<T>(s, k, h, x, look)
                                                                     : of_runge_kutta<T>(s, k, h, x, look);
      sum += slope;
      if (k + 1 < steps_) x += h * slope;
    }
    return steps_ == 1 ? sum : StageVector<T>(sum / T(steps_));
  }

 private:
  template <class T>
  Stage<T> stage(const Stage<T>& s, int halves, const T& h, const StageVector<T>& x) const {
    const Eigen::Index first = halves == 0 ? 0 : n_p_ + 1 + (halves - 1) * n_p_;
    return {s.t + T(0.5 * halves) * h, x, s.a, s.u, s.p.segment(first, n_p_)};
  }

  template <class T>
  StageVector<T> rate(const Stage<T>& stage, double share, const Look<T>& look) const {
    StageVector<T> rate = problem_->rate(stage);
    check_rate(*problem_, rate.size());
    if (look) look(stage, share / steps_);
    return rate;
  }

  template <class T>
  StageVector<T> of_runge_kutta(const Stage<T>& s, int k, const T& h, const StageVector<T>& x,
                                const Look<T>& look) const {
    const T half = T(0.5) * h;
    const StageVector<T> k1 = rate<T>(stage<T>(s, 2 * k, h, x), 1. / 6, look);
    const StageVector<T> k2 = rate<T>(stage<T>(s, 2 * k + 1, h, x + half * k1), 1. / 3, look);
    const StageVector<T> k3 = rate<T>(stage<T>(s, 2 * k + 1, h, x + half * k2), 1. / 3, look);
    const StageVector<T> k4 = rate<T>(stage<T>(s, 2 * k + 2, h, x + h * k3), 1. / 6, look);
    return (k1 + T(2) * (k2 + k3) + k4) / T(6);
  }

  template <class T>
  StageVector<T> of_euler(const Stage<T>& s, int k, const T& h, const StageVector<T>& x,
                          const Look<T>& look) const {
    StageVector<T> slope = rate<T>(stage<T>(s, 2 * k, h, x), 1, look);
    const Eigen::Index n_q = problem_->positions;
    if (n_q == 0) return slope;
    StageVector<T> moved = x;  // positions move by the new velocities
    moved.tail(n_x_ - n_q) += h * slope.tail(n_x_ - n_q);
    slope.head(n_q) = rate<T>(stage<T>(s, 2 * k, h, moved), 0, {}).head(n_q);
    return slope;
  }

  std::shared_ptr<const Problem> problem_;
  ShootingScheme scheme_;
  int steps_;
  Eigen::Index n_x_, n_p_;
};

// Residuals at all looks, each with the root of its share.
StageFunction residuals_of(const Steps& steps, const StageFunction& of) {
  return [steps, of](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    StageVector<T> all;
    steps(s, Steps::Look<T>([&](const Stage<T>& at, double share) {
            const StageVector<T> r = of(at);
            all.conservativeResize(all.size() + r.size());
            all.tail(r.size()) = T(std::sqrt(share)) * r;
          }));
    return all;
  };
}

// int L dt over the interval, over its length.  Steps of several terms are one on the tape, where equal operations are.
Term cost_of(const Steps& steps, const Term& cost) {
  Term result = running_cost(cost.name, [steps, cost](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    T sum(0);
    steps(s, Steps::Look<T>([&](const Stage<T>& at, double share) {
            const StageVector<T> value = cost.function(at);
            check_cost(steps.problem(), cost.name, value.size());
            sum += T(share) * value[0];
          }));
    return sum;
  });
  if (!cost.curvature.empty()) result.curvature = residuals_of(steps, cost.curvature);
  return result;
}

}  // namespace

IntervalLength interval_lengths(std::vector<double> nodes) {
  return [nodes = std::move(nodes)](double t) {
    const auto next = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, t);
    return *next - *(next - 1);
  };
}

Problem multiple_shooting(const Problem& problem, ShootingScheme scheme, int steps,
                          const IntervalLength& length) {
  if (problem.n_a() > 0 && (scheme != ShootingScheme::kEuler || steps != 1))
    refuse(problem,
           "the dynamics are in their inverse form, which steps do not know; expected the "
           "forward form");
  if (steps < 1) refuse(problem, std::to_string(steps) + " steps an interval, expected at least one");
  Problem result = problem;
  result.parameters.add("length of an interval",
                        [length](double t) { return Eigen::VectorXd::Constant(1, length(t)); });
  const bool asks_later = problem.parameters.size() > 0 && (scheme != ShootingScheme::kEuler || steps > 1);
  for (int k = 1; k <= 2 * steps && asks_later; ++k) {
    result.parameters.add(std::to_string(k) + "/" + std::to_string(2 * steps) + " of an interval later",
                          [=, of = problem.parameters, end = problem.duration](double t) {
                            return of.at(std::min(t + k * length(t) / (2 * steps), end));
                          });
  }
  const Steps of_interval(problem, scheme, steps);
  result.rate = [of_interval](const auto& s) { return of_interval(s); };
  result.terms.clear();
  for (const Term& term : problem.terms) {
    const bool is_running = term.where == Where::kRunning;
    if (is_running && term.role == Role::kCost)
      result.add(cost_of(of_interval, term));
    else if (is_running && term.role == Role::kSquares)
      result.add(running_squares(term.name, residuals_of(of_interval, term.function)));
    else
      result.add(term);
  }
  return result;
}

}  // namespace dyntape
