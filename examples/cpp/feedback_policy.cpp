// SPDX-License-Identifier: BSD-3-Clause
//
// A motion with a feedback policy: swing a pendulum up with a weak motor by differential dynamic programming, then
// disturb it, with and without the policy.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/solve/ddp.h>

using namespace dyntape;

constexpr double kMass = 1, kLength = 0.5, kGravity = 9.81, kDamping = 0.05;  // kg, m, m/s^2, N m s
constexpr double kTorque = 2.5;  // N m: half of the torque that holds it level

// Angle (rad), 0 when hanging, and its rate; the torque of the motor.
const auto pendulum = [](const auto& s) {
  using std::sin;
  using T = std::decay_t<decltype(s.t)>;
  const T pull = s.u[0] - kDamping * s.x[1] - kMass * kGravity * kLength * sin(s.x[0]);
  return vector(T(s.x[1]), T(pull / (kMass * kLength * kLength)));
};

Problem swing_up() {
  Problem p("pendulum", {"angle", "rate"}, {"torque"}, 3.0, pendulum);
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.add(terminal_squares("upright", [](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(20.0 * (s.x[0] - std::numbers::pi)), T(20.0 * s.x[1]));
  }));
  p.start << 0, 0;
  p.goal.setConstant(Problem::kFree);
  p.u.lower[0] = -kTorque, p.u.upper[0] = kTorque;
  p.guess = [](double t) {
    return Stage<double>{t, Eigen::Vector2d::Zero(), {}, Eigen::VectorXd::Constant(1, std::sin(4 * t))};
  };
  return p;
}

// The final state after a push of 0.1 rad/s in the middle; gain 1: with the policy, 0: without.
Eigen::VectorXd end_of(const Problem& problem, const DdpSolution& plan, double gain) {
  Eigen::VectorXd x = problem.start;
  for (Eigen::Index k = 0; k < plan.u.cols(); ++k) {
    if (k == plan.u.cols() / 2) x[1] += 0.1;
    Eigen::VectorXd u = plan.u.col(k) + gain * plan.policy[std::size_t(k)].K * (x - plan.x.col(k));
    u = u.cwiseMax(-kTorque).cwiseMin(kTorque);
    x = simulate(problem, x, plan.t[k], plan.t[k + 1], [&](double) { return u; }).x;
  }
  return x;
}

int main() try {
  const Problem problem = swing_up();
  const DdpSolution plan = solve_with_ddp(problem, {.intervals = 150});
  std::printf("%s in %zu iterations, %.1f ms: cost %.5f, largest torque %.2f N m, true defect %.0e\n",
              to_string(plan.status), plan.iterations.size(), 1e3 * plan.seconds, plan.cost,
              plan.u.cwiseAbs().maxCoeff(), plan.integration_error);
  const Eigen::VectorXd with = end_of(problem, plan, 1), without = end_of(problem, plan, 0);
  std::printf("pushed on the way: ends %.3f rad from upright with the policy, %.3f rad without\n",
              std::abs(with[0] - std::numbers::pi), std::abs(without[0] - std::numbers::pi));
  const bool helps = std::abs(with[0] - std::numbers::pi) < 0.3 * std::abs(without[0] - std::numbers::pi);
  return plan.success() && helps ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
