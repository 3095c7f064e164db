// SPDX-License-Identifier: BSD-3-Clause
//
// Your own optimal control problem: swing a pole up on a cart, with a cost and a constraint that task files do not
// have.  Both are lambdas; recording, derivatives, transcription and Ipopt need no further code.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/solve.h>

using namespace dyntape;

constexpr double kCart = 1.0, kBob = 0.3, kLength = 0.5, kGravity = 9.81;  // kg, kg, m, m/s^2

// State x = (p, th, p', th'): cart position (m) and angle of the pole (rad), 0 when hanging; control u: force on the
// cart (N).  Generic in the scalar: `s` holds doubles or taped values.
const auto cart_pole = [](const auto& s) {
  using std::cos, std::sin;
  using T = std::decay_t<decltype(s.t)>;
  const T c = cos(s.x[1]), n = sin(s.x[1]), w = s.x[3], u = s.u[0];
  const T d = kCart + kBob * n * n;
  const T acceleration = (kLength * kBob * n * w * w + u + kBob * kGravity * c * n) / d;
  const T spin = -(kLength * kBob * c * n * w * w + u * c + (kCart + kBob) * kGravity * n) / (kLength * d);
  return vector(T(s.x[2]), w, acceleration, spin);
};

// Tip of the pole: position along the rail, and the square of its speed.
const auto tip_position = [](const auto& s) {
  using std::sin;
  return s.x[0] + kLength * sin(s.x[1]);
};
const auto tip_speed_squared = [](const auto& s) {
  using std::cos;
  return s.x[2] * s.x[2] + 2.0 * kLength * cos(s.x[1]) * s.x[2] * s.x[3] +
         kLength * kLength * s.x[3] * s.x[3];
};

Problem swing_up() {
  Problem p("swing-up", {"p", "th", "pd", "thd"}, {"u"}, 2.0, cart_pole);
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));  // int u^2 dt
  p.start << 0, 0, 0, 0;
  p.goal << 1, std::numbers::pi, 0, 0;
  p.u.lower[0] = -20;
  p.u.upper[0] = 20;
  return p;
}

double farthest_tip(const Trajectory& motion) {
  return (motion.x.row(0).array() + kLength * motion.x.row(1).array().sin()).maxCoeff();
}

int main() try {
  const Solution plain = solve(swing_up());

  Problem p = swing_up();
  p.add(running_cost("gentle tip", [](const auto& s) { return 2.0 * tip_speed_squared(s); }));
  p.add(path_inequality(
      "wall", [](const auto& s) { return tip_position(s); }, Eigen::VectorXd::Constant(1, -10.0),
      Eigen::VectorXd::Constant(1, 1.3)));
  const Solution custom = solve(p);

  for (const Solution* s : {&plain, &custom}) {
    std::printf(
        "%-7s %s in %2d iterations: cost %9.5f, tip reaches %.4f m, violation %.0e, true defect %.0e\n",
        s == &plain ? "plain" : "custom", to_string(s->nlp.status), s->iterations(), s->cost(),
        farthest_tip(s->motion), s->verification.violation, s->verification.worst_defect);
  }
  const bool good = plain.success() && custom.success() && farthest_tip(plain.motion) > 1.5 &&
                    farthest_tip(custom.motion) < 1.3 + 1e-6 && custom.verification.violation < 1e-6;
  return good ? 0 : 1;
} catch (const Error& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
