// SPDX-License-Identifier: BSD-3-Clause
//
// Your own dynamics, not of a robot: a boat goes down a river in least time; the current grows with the distance
// from the bank (E. Zermelo's problem).
//
//   x' = V cos(h) + c y,   y' = V sin(h)          heading h, own speed V (m/s), c the current's growth (1/s)
//
// A rate is a lambda of the stage (interface/control/problem/stage.h).  Optimal headings satisfy h' = -c cos(h)^2,
// so tan(h) decreases by c per second.  The program checks this; the solver does not know it.
#include <cmath>
#include <cstdio>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/optimise.h>

using namespace dyntape;

constexpr double kSpeed = 1, kGrowth = 0.7;  // m/s, 1/s

Problem journey() {
  Problem p("journey", {"along", "across"}, {"heading"}, 5, [](const auto& s) {
    using std::cos, std::sin;
    using T = std::decay_t<decltype(s.t)>;  // AD while recording, double in the verification
    return vector(T(kSpeed * cos(s.u[0]) + kGrowth * s.x[1]), T(kSpeed * sin(s.u[0])));
  });
  p.add(minimum_time(1));
  p.free_duration(0.5, 20);
  p.start << 0, 0;
  p.goal << 6, 1;
  p.guess = [](double t) {  // straight to the goal
    return Stage<double>{t, Eigen::Vector2d(6, 1) * t / 5, {}, Eigen::VectorXd::Zero(1)};
  };
  return p;
}

int main() try {
  const Solution s = optimise(journey(), {.mesh = {.intervals = 40}});
  const Trajectory& motion = s.motion;
  const double T = motion.t[motion.points() - 1], first = std::tan(motion.u(0, 0));
  std::printf("%s in %d iterations: there in %.6f s\n", to_string(s.nlp.status), s.nlp.iterations(), T);
  double worst = 0;
  for (int k = 0; k <= motion.intervals(); ++k) {
    const int at = motion.node(k);
    const double law = std::atan(first - kGrowth * motion.t[at]);
    worst = std::max(worst, std::abs(motion.u(0, at) - law));
    if (k % 10 == 0)
      std::printf("t = %5.3f s: at (%6.3f, %5.3f) m, heading %7.3f deg, by the law %7.3f\n", motion.t[at],
                  motion.x(0, at), motion.x(1, at), motion.u(0, at) * 180 / M_PI, law * 180 / M_PI);
  }
  std::printf("largest difference to the law %.1e rad; the controls alone miss the place by %.1e m\n", worst,
              s.verification.miss);
  return s.success() && worst < 1e-3 && s.verification.miss < 1e-6 ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
