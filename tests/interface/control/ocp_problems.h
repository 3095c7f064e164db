// SPDX-License-Identifier: BSD-3-Clause
//
// Problems with known optima, written out by hand: no robot file, no dynamics library.
#pragma once

#include <cmath>
#include <numbers>

#include <dyntape/interface/control/solve/optimise.h>

#include "interface/interpreted.h"

namespace dyntape::test {

// Those of the table and some of each family; pseudospectral ones, which are for one interval, are tested apart.
inline std::vector<Scheme> every_scheme() {
  std::vector<Scheme> all = schemes();
  for (const Scheme& scheme : {lobatto(2), lobatto(5), radau(1), radau(3)}) all.push_back(scheme);
  return all;
}

// p'' = u, rest to rest over a distance in 1 s, least int u^2.  Continuous optimum 12 d^2/T^3.
inline Problem block_move(double distance = 1, double duration = 1) {
  Problem p("block move", {"p", "v"}, {"u"}, duration, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 0, 0;
  p.goal << distance, 0;
  return p;
}

// Cart 1 kg on a rail, point mass 0.3 kg on a rod of 0.5 m that hangs at th = 0; u pushes the cart.
// M. Kelly, "An introduction to trajectory optimization", SIAM Review 59(4), 2017, appendix E.
inline auto cart_pole_rate() {
  return [](const auto& s) {
    using std::cos, std::sin;
    const double m1 = 1, m2 = 0.3, l = 0.5, g = 9.81;
    const auto &th = s.x[1], &w = s.x[3], &u = s.u[0];
    const auto c = cos(th), n = sin(th), d = m1 + m2 * n * n;
    using T = std::decay_t<decltype(d)>;
    const T acceleration = (l * m2 * n * w * w + u + m2 * g * c * n) / d;
    const T spin = -(l * m2 * c * n * w * w + u * c + (m1 + m2) * g * n) / (l * d);
    return vector(T(s.x[2]), T(w), acceleration, spin);
  };
}

// Swing-up: rest hanging at 0 to rest upright at 1 m in 2 s, least int u^2 + weight |x - goal|^2.
inline Problem swing_up(double weight = 0, double force_limit = 20) {
  Problem p("cart-pole", {"p", "th", "pd", "thd"}, {"u"}, 2.0, cart_pole_rate());
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start << 0, 0, 0, 0;
  p.goal << 1, std::numbers::pi, 0, 0;
  p.x.lower[0] = -2;
  p.x.upper[0] = 2;
  p.u.lower[0] = -force_limit;
  p.u.upper[0] = force_limit;
  if (weight > 0) {
    const Eigen::VectorXd goal = p.goal;
    p.add(running_squares("tracking", [=](const auto& s) {
      return (std::sqrt(weight) * (s.x - goal.cast<typename std::decay_t<decltype(s.x)>::Scalar>())).eval();
    }));
  }
  p.guess = [](double t) {
    const double s = t / 2;
    return Stage<double>{t, Eigen::Vector4d(s, std::numbers::pi * s, 0, 0), {}, Eigen::VectorXd::Zero(1)};
  };
  return p;
}

// A goal upright at 1 m that costs at the end instead of being demanded; states p, th, pd, thd from rest hanging at 0.
inline void swing_up_softly(Problem& p, double weight, double force_limit) {
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.add(terminal_squares("upright", [weight](const auto& s) {
    const double goal[] = {1, std::numbers::pi, 0, 0};
    auto off = s.x;
    for (int i = 0; i < 4; ++i) off[i] = weight * (s.x[i] - goal[i]);
    return off;
  }));
  p.start.setZero();
  p.goal.setConstant(Problem::kFree);
  p.u.lower[0] = -force_limit, p.u.upper[0] = force_limit;
  p.guess = [](double t) {
    return Stage<double>{
        t, Eigen::Vector4d(t / 2, std::numbers::pi * t / 2, 0, 0), {}, Eigen::VectorXd::Constant(1, 0.1)};
  };
}

inline Problem soft_swing_up(double force_limit = HUGE_VAL) {
  Problem p("cart-pole, softly", {"p", "th", "pd", "thd"}, {"u"}, 2.0, cart_pole_rate());
  swing_up_softly(p, 30, force_limit);
  return p;
}

// A mass on a line that follows a reference of time, its force limited.
inline Problem follower(double horizon) {
  Problem p("follower", {"p", "v"}, {"u"}, horizon, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  const Parameter reference =
      p.parameters.add("reference", [](double t) { return Eigen::VectorXd::Constant(1, std::sin(t)); });
  p.add(running_squares("near", [reference](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(10.0 * (s.x[0] - reference(s)[0])));
  }));
  p.add(running_squares("effort", [](const auto& s) { return (0.01 * s.u).eval(); }));
  p.start << 0, 0;
  p.u.lower[0] = -5, p.u.upper[0] = 5;
  return p;
}

}  // namespace dyntape::test
