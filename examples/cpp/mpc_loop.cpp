// SPDX-License-Identifier: BSD-3-Clause
//
// A control loop: measure, plan from the measured state, apply the plan's control until the next measurement.  The
// plan is an optimal control problem over the next second, built once and solved every 50 ms by one quadratic
// program (the real-time iteration).
//
// The plant differs from the model: its load is heavier than the controller assumes, until the parameter is updated
// in place.  For such loops in one call, with disturbances and delays, use close_loop() in
// interface/control/mpc/closed_loop.h.
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>

using namespace dyntape;

constexpr double kPeriod = 0.05, kTrueLoad = 1.5;  // s, kg

double wanted(double t) { return 0.5 * std::sin(t); }  // rad

// An arm of one joint lifts a load at its end, 0.4 m from the joint; angle from horizontal (rad), its rate, torque
// (N m).
Problem lifting() {
  Parameters parameters;
  const Parameter load = parameters.add("load", 1.0);  // kg: the controller's assumption
  const Parameter reference =
      parameters.add("reference", [](double t) { return Eigen::VectorXd::Constant(1, wanted(t)); });
  Problem p("lift", {"angle", "rate"}, {"torque"}, 1.0, [load](const auto& s) {
    using std::cos;
    using T = std::decay_t<decltype(s.t)>;
    const T m = load(s)[0];
    return vector(T(s.x[1]), T((s.u[0] - m * 9.81 * 0.4 * cos(s.x[0])) / (m * 0.4 * 0.4)));
  });
  p.parameters = parameters;
  p.add(running_squares("near",
                        [reference](const auto& s) { return (10.0 * (s.x.head(1) - reference(s))).eval(); }));
  p.add(running_squares("calm", [](const auto& s) { return (0.02 * s.u).eval(); }));
  p.start << 0, 0;
  p.u.lower[0] = -15, p.u.upper[0] = 15;
  return p;
}

int main() try {
  RecedingHorizon mpc(lifting(),
                      {.mesh = {.scheme = trapezoid(), .intervals = 20, .hessian = HessianKind::kGaussNewton},
                       .iterations = 1});
  const int compiled = mpc.build().compiled;
  Problem plant = lifting();
  plant.parameters.set("load", kTrueLoad);
  Eigen::VectorXd x = plant.start;
  double off[2] = {0, 0}, longest = 0;  // error of the reference, before and after the update
  for (int k = 0; k < 240; ++k) {
    const double t = k * kPeriod;
    if (k == 120) mpc.values().parameters.set("load", kTrueLoad);  // without recording or compiling
    const MpcStep& step = mpc.step(t, x);
    if (!step.usable) return std::printf("no usable plan at %.2f s: %s\n", t, to_string(step.status)), 1;
    if (k > 0) longest = std::max(longest, step.seconds);
    if (k % 120 >= 60) off[k / 120] = std::max(off[k / 120], std::abs(x[0] - wanted(t)));
    if (k % 30 == 0)
      std::printf("t = %5.2f s: angle %6.3f, wanted %6.3f rad, torque %6.2f N m, planned in %.2f ms\n", t,
                  x[0], wanted(t), step.plan.control(t)[0], 1e3 * step.seconds);
    x = simulate(plant, x, 0, kPeriod, [&](double after) { return step.plan.control(t + after); }).x;
  }
  std::printf("off by %.4f rad with the wrong load, by %.4f rad with the right one; longest step %.2f ms\n",
              off[0], off[1], 1e3 * longest);
  return off[1] < 0.25 * off[0] && off[1] < 0.02 && mpc.build().compiled == compiled ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
