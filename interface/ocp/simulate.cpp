// SPDX-License-Identifier: BSD-3-Clause
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation/generation_controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation/generation_runge_kutta_fehlberg78.hpp>
#include <boost/numeric/odeint/stepper/generation/make_controlled.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cmath>

#include <dyntape/interface/ocp/verify.h>

namespace dyntape {

namespace {

constexpr int kMostSteps = 200000;

}  // namespace

Eigen::VectorXd simulate(const Problem& problem, Eigen::VectorXd x, double from, double to,
                         const std::function<Eigen::VectorXd(double t)>& control, double tolerance) {
  namespace odeint = boost::numeric::odeint;
  using State = std::vector<double>;
  const auto rate = [&](const State& state, State& derivative, double t) {
    const Eigen::Map<const Eigen::VectorXd> now(state.data(), Eigen::Index(state.size()));
    const Eigen::VectorXd f = problem.ode(Stage<double>{t, now, {}, control(t)});
    derivative.assign(f.begin(), f.end());
  };
  auto stepper = odeint::make_controlled(tolerance, tolerance, odeint::runge_kutta_fehlberg78<State>());
  State state(x.begin(), x.end());
  double t = from, dt = (to - from) / 4;
  const double smallest = 1e-14 * std::max(1.0, std::abs(to));
  for (int k = 0; to - t > smallest; ++k) {
    dt = std::min(dt, to - t);
    const bool finite = std::isfinite(state[0]) && std::isfinite(state.back());
    if (k == kMostSteps || dt < smallest || !finite) return Eigen::VectorXd::Constant(x.size(), std::nan(""));
    stepper.try_step(rate, state, t, dt);  // moves t on, or only shortens dt
  }
  return Eigen::Map<const Eigen::VectorXd>(state.data(), x.size());
}

}  // namespace dyntape
