// SPDX-License-Identifier: BSD-3-Clause
//
// Parameters: the hook of a crane follows a changing reference.  The problem is recorded and compiled once.  Every
// new reference, load and start is set in place, followed by a solve from the last motion.
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/optimise.h>

using namespace dyntape;

constexpr double kHorizon = 2, kStep = 0.5, kRope = 1.5, kGravity = 9.81;  // s, s, m, m/s^2

// Trolley (m) and angle of the rope (rad), their rates; the trolley's acceleration is the control.
Problem crane() {
  Problem p("crane", {"trolley", "sway", "speed", "sway_rate"}, {"drive"}, kHorizon, [](const auto& s) {
    using std::sin, std::cos;
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[2]), T(s.x[3]), T(s.u[0]),
                  T(-(kGravity * sin(s.x[1]) + s.u[0] * cos(s.x[1])) / kRope));
  });
  const Parameter gentle = p.parameters.add("gentle", 0.1);
  const Parameter reference = p.parameters.add("reference", [](double) { return Eigen::VectorXd::Zero(1); });
  p.add(running_squares("near", [reference](const auto& s) {
    using std::sin;
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(3.0 * (s.x[0] + kRope * sin(s.x[1]) - reference(s)[0])));
  }));
  p.add(terminal_squares("calm", [](const auto& s) { return s.x.tail(3).eval(); }));
  p.add(running_squares("effort", [gentle](const auto& s) { return (s.u * gentle(s)[0]).eval(); }));
  p.start << 0, 0, 0, 0;
  p.u.lower[0] = -4, p.u.upper[0] = 4;
  return p;
}

int main() try {
  StagedNlp nlp = discretize(crane(), {.intervals = 40});
  const BuildReport made = nlp.build();
  std::printf("made once: record %.1f ms, compile %.0f ms\n", 1e3 * made.seconds.record,
              1e3 * made.seconds.compile);
  std::vector<double> x = nlp.start();
  double worst = 0;
  for (int round = 0; round < 8; ++round) {
    const double now = round * kStep,
                 goal = round < 4 ? 1.0 : -0.5;  // the reference changes after 2 s
    Problem values = nlp.problem();
    values.parameters.set("reference", [=](double t) {
      return Eigen::VectorXd::Constant(1, goal + 0.1 * std::sin(2 * (now + t)));
    });
    if (round == 4) values.parameters.set("gentle", 0.05);
    if (round > 0) {  // the state of the last motion at this time
      const Trajectory last = nlp.trajectory(x);
      values.start = last.x.col(last.node(int(kStep / kHorizon * last.intervals())));
    }
    nlp.set_values(values);
    const Solution s = optimise(nlp, x, {.check_derivatives = false});
    if (!s.converged()) return 1;
    x = s.nlp.x;
    const double hook =
        s.motion.x(0, s.motion.points() - 1) + kRope * std::sin(s.motion.x(1, s.motion.points() - 1));
    const double off = std::abs(hook - goal - 0.1 * std::sin(2 * (now + kHorizon)));
    if (round % 4 == 3) worst = std::max(worst, off);  // after enough time to reach it
    std::printf("t = %.1f s: %2d iterations, %5.1f ms, ends %.3f m from the reference, start %.3f m\n", now,
                s.nlp.iterations(), 1e3 * s.nlp.times.total, off, s.motion.x(0, 0));
  }
  const BuildReport still = nlp.build();
  return worst < 0.05 && still.compiled == made.compiled && still.from_cache == made.from_cache ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
