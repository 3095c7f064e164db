// SPDX-License-Identifier: BSD-3-Clause
//
// Problems whose optima are known to many digits, and what tests of them share.
#pragma once

#include <gtest/gtest.h>

#include <cstring>

#include <dyntape/interface/control/discretize/resampled.h>
#include "ocp_problems.h"

namespace dyntape::test {

constexpr double kPi = std::numbers::pi;

// Options under which twelve digits of an optimum can be seen.
inline SolverOptions tight(NlpMethod method) {
  return {.method = method, .tolerance = 1e-12, .dual_tolerance = 1e-10, .bound_relaxation = 0};
}

// Whether a number, rounded to as many decimals as are written, is the one that is written.
inline ::testing::AssertionResult has_digits(double value, const char* written) {
  const char* point = std::strchr(written, '.');
  char rounded[64];
  std::snprintf(rounded, sizeof rounded, "%.*f", point ? int(std::strlen(point)) - 1 : 0, value);
  if (std::strcmp(rounded, written) == 0) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << rounded << " in place of " << written;
}

inline std::string method_name(const ::testing::TestParamInfo<NlpMethod>& info) {
  return info.param == NlpMethod::kIpopt ? "ipopt" : "stages";
}

// What is solved is looked at: the optimum and how it was found.
struct Solved {
  NlpSolution nlp;
  Trajectory motion;
  Eigen::VectorXd
      slope_by_start;  // (n_x) of the optimum, by the state that is given at t = 0: the costates there

  double cost() const { return nlp.objective; }
  double duration() const { return motion.t[motion.points() - 1]; }
  bool success() const { return nlp.status == SolveStatus::kSolved; }
};

// d/dx0 (f + lambda . g), the start being variables of the program that do not move.
inline Eigen::VectorXd slope_by_start(StagedNlp& program, const NlpSolution& s) {
  const Pattern& pattern = program.shape().jacobian;
  std::vector<double> gradient(s.x.size()), jacobian(pattern.nnz());
  program.gradient(s.x.data(), gradient.data());
  program.jacobian(s.x.data(), jacobian.data());
  Eigen::VectorXd slope = Eigen::VectorXd::Map(gradient.data(), program.problem().n_x());
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    if (Eigen::Index(pattern.col[k]) < slope.size())
      slope[Eigen::Index(pattern.col[k])] += s.lambda[std::size_t(pattern.row[k])] * jacobian[k];
  }
  return slope;
}

// From the problem's guess, or from a motion on another mesh.
inline Solved solve_on(const Problem& problem, const MeshOptions& mesh, const SolverOptions& options,
                       const Trajectory* from = nullptr) {
  MeshOptions interpreted = mesh;
  interpreted.evaluation = kInterpreted;
  StagedNlp program = discretize(problem, interpreted);
  Solved s;
  s.nlp = solve_nlp(program,
                    from ? program.variables(resampled(problem, *from, program.times())) : program.start(),
                    options);
  s.motion = program.trajectory(s.nlp.x);
  s.slope_by_start = slope_by_start(program, s.nlp);
  return s;
}

// Swing-up of the cart-pole from the start that leads to the lower of its two basins.
inline Problem swing_up_low(double force_limit = 20, double weight = 0) {
  Problem p = swing_up(weight, force_limit);
  p.guess = [](double t) {
    const double s = t / 2;
    return Stage<double>{
        t, Eigen::Vector4d(s, kPi * s - 2 * std::sin(kPi * s), 0, 0), {}, Eigen::VectorXd::Zero(1)};
  };
  return p;
}

// x^(order) = u, rest to rest over a distance, least int u^2: 12 d^2/T^3, 720 d^2/T^5 (jerk), 100800 d^2/T^7 (snap).
inline Problem chain_of_integrators(int order, double distance, double duration) {
  std::vector<std::string> names;
  for (int i = 0; i < order; ++i) names.push_back("x" + std::to_string(i));
  Problem p("chain", names, {"u"}, duration, [order](const auto& s) {
    auto rate = s.x;
    rate.head(order - 1) = s.x.tail(order - 1);
    rate[order - 1] = s.u[0];
    return rate;
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start.setZero();
  p.goal.setZero();
  p.goal[0] = distance;
  return p;
}

// Two point masses of 1 kg on massless links of 0.5 m, absolute angles from hanging; the elbow's torque u turns the second
// link by +u and the first by -u.  Rest hanging to rest upright in 2 s, least int u^2.
inline Problem acrobot(const std::function<Eigen::Vector2d(double t)>& angles,
                       const std::function<Eigen::Vector2d(double t)>& velocities) {
  Problem p("acrobot", {"q1", "q2", "v1", "v2"}, {"u"}, 2.0, [](const auto& s) {
    using std::cos, std::sin;
    const double m1 = 1, m2 = 1, l = 0.5, g = 9.81;
    const auto &q1 = s.x[0], &q2 = s.x[1], &v1 = s.x[2], &v2 = s.x[3], &u = s.u[0];
    using T = std::decay_t<decltype(s.t)>;
    const T c = cos(q1 - q2), n = sin(q1 - q2);
    const T a11 = T((m1 + m2) * l * l), a12 = m2 * l * l * c, a22 = T(m2 * l * l);
    const T b1 = -u - m2 * l * l * n * v2 * v2 - (m1 + m2) * g * l * sin(q1);
    const T b2 = u + m2 * l * l * n * v1 * v1 - m2 * g * l * sin(q2);
    const T d = a11 * a22 - a12 * a12;
    return vector(T(v1), T(v2), T((a22 * b1 - a12 * b2) / d), T((a11 * b2 - a12 * b1) / d));
  });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.start.setZero();
  p.goal << kPi, kPi, 0, 0;
  p.guess = [=](double t) {
    const Eigen::Vector2d q = angles(t), v = velocities(t);
    return Stage<double>{t, Eigen::Vector4d(q[0], q[1], v[0], v[1]), {}, Eigen::VectorXd::Zero(1)};
  };
  return p;
}

// q_i = pi s + a_i sin pi s + b_i sin 2 pi s, s = t/2, with its velocities.
inline Problem acrobot_from_sines(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return acrobot(
      [=](double t) -> Eigen::Vector2d {
        const double s = kPi * t / 2;
        return Eigen::Vector2d::Constant(s) + a * std::sin(s) + b * std::sin(2 * s);
      },
      [=](double t) -> Eigen::Vector2d {
        const double s = kPi * t / 2, r = kPi / 2;
        return r * (Eigen::Vector2d::Ones() + a * std::cos(s) + 2 * b * std::cos(2 * s));
      });
}

// The starts of basins C, D and E; E by a table, whose velocities are central differences on the mesh of N intervals.
inline Problem acrobot_c() { return acrobot_from_sines({-1, 0}, {-1, -1}); }
inline Problem acrobot_d() { return acrobot_from_sines({-2, 4}, {1, 1}); }
inline Problem acrobot_e(int intervals) {
  const auto angles = [](double t) -> Eigen::Vector2d {
    constexpr double kQ1[] = {0,    .09,  .1, -.27, -.65, -.79, -.69, -.44, -.2,  -.15, -.51,
                              -.75, -.44, .1, .95,  1.73, 2.11, 2.35, 2.66, 2.99, 3.14};
    constexpr double kQ2[] = {0,    -.14, -.16, .4,   1.07, 1.67, 2.33, 3.05, 3.81, 4.63, 5.75,
                              6.81, 7.44, 7.59, 6.89, 6.01, 5.26, 4.49, 3.88, 3.36, 3.14};
    const int i = std::min(int(10 * t + 1e-9), 19);
    const double r = 10 * t - i;
    return {(1 - r) * kQ1[i] + r * kQ1[i + 1], (1 - r) * kQ2[i] + r * kQ2[i + 1]};
  };
  return acrobot(angles, [=](double t) -> Eigen::Vector2d {
    const double h = 2. / intervals, from = std::max(t - h, 0.), to = std::min(t + h, 2.);
    return (angles(to) - angles(from)) / (to - from);
  });
}

// Least time from rest along a wire, Y down and X across; the control is the wire's angle from the vertical.
inline Problem brachistochrone(double X, double Y, double g) {
  Problem p("brachistochrone", {"across", "down", "speed"}, {"angle"}, 1.5, [g](const auto& s) {
    using std::cos, std::sin;
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[2] * sin(s.u[0])), T(s.x[2] * cos(s.u[0])), T(g * cos(s.u[0])));
  });
  p.add(minimum_time(1));
  p.free_duration(0.1, 10);
  p.start << 0, 0, 0;
  p.goal << X, Y, Problem::kFree;
  p.guess = [=](double t) {
    const double s = t / 1.5;
    return Stage<double>{t,
                         Eigen::Vector3d(X * s, Y * s, std::sqrt(2 * g * Y) * s),
                         {},
                         Eigen::VectorXd::Constant(1, std::atan2(X, Y))};
  };
  return p;
}

// x' = u, x(0) = 1, least int x^2 + u^2 over 1 s.
inline Problem catenary() {
  Problem p("catenary", {"x"}, {"u"}, 1, [](const auto& s) { return s.u; });
  p.add(running_squares("both", [](const auto& s) { return vector(s.x[0], s.u[0]); }));
  p.start << 1;
  p.goal << 0.75;
  return p;
}

}  // namespace dyntape::test
