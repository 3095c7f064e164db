// SPDX-License-Identifier: BSD-3-Clause
//
// Optima that have a closed form, of the continuous problem or of the one on a mesh.
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/motion/robot_problem.h>
#include "dynamics/robot_files.h"
#include "interface/control/known_problems.h"

namespace dyntape::known_oracles_test {
namespace {

using Eigen::VectorXd;
using test::block_move;
using test::brachistochrone;
using test::catenary;
using test::chain_of_integrators;
using test::has_digits;
using test::solve_on;
using test::Solved;
using test::tight;

class KnownOracles : public ::testing::TestWithParam<NlpMethod> {};
INSTANTIATE_TEST_SUITE_P(By, KnownOracles, ::testing::Values(NlpMethod::kIpopt, NlpMethod::kRiccati),
                         test::method_name);

// Of n intervals the closed forms; the digits are those of the reference.
TEST_P(KnownOracles, BlockMoveByItsDigits) {
  for (const auto& [n, trapezoidal, explicit_euler] :
       {std::tuple(5, "13.8889", "12.50000"), {10, "12.46106", "12.12121"}, {20, "12.11662", "12.03008"}}) {
    EXPECT_TRUE(
        has_digits(solve_on(block_move(), {.scheme = trapezoid(), .intervals = n}, tight(GetParam())).cost(),
                   trapezoidal));
    EXPECT_TRUE(
        has_digits(solve_on(block_move(), {.scheme = euler(), .intervals = n}, tight(GetParam())).cost(),
                   explicit_euler));
    // Any distance and time: d^2 / T^3 of it.
    const Solved other = solve_on(block_move(-3, 0.5), {.intervals = n}, tight(GetParam()));
    EXPECT_NEAR(other.cost(), 12 * 9 / 0.125, 1e-10 * 864);
    const Solved straight =
        solve_on(block_move(), {.scheme = scheme_by_name("hermite-simpson-linear"), .intervals = n},
                 tight(GetParam()));
    EXPECT_NEAR(straight.cost(), 12, 1e-11);  // its controls are straight anyway
    EXPECT_NEAR(other.motion.u(0, 0), -6 * 3 / 0.25, 1e-9 * 72);
  }
}

// |u| <= a: J = a^2 (3 - 4 s) / 3 with s = sqrt(3/4 - 3/a) for 4 <= a <= 6; as without a limit above; none below 4.
TEST_P(KnownOracles, BlockMoveWithinLimits) {
  const auto solved = [&](double a, int n) {
    Problem p = block_move();
    p.u.lower[0] = -a, p.u.upper[0] = a;
    return solve_on(p, {.intervals = n}, tight(GetParam()));
  };
  EXPECT_TRUE(has_digits(solved(5, 40).cost(), "12.090054"));
  for (const double a : {4.2, 4.5, 5., 5.5}) {
    const double s = std::sqrt(0.75 - 3 / a), J = a * a * (3 - 4 * s) / 3;
    // The mesh rounds the two instants at which u leaves its limit: off by the square of the step, of either sign.
    EXPECT_NEAR(solved(a, 80).cost(), J, J * 0.3 / (80 * 80)) << a;
    EXPECT_NEAR(solved(a, 320).cost(), J, J * 0.3 / (320 * 320)) << a;
  }
  EXPECT_NEAR(solved(6, 40).cost(), 12, 1e-9);
  EXPECT_NEAR(solved(7, 40).cost(), 12, 1e-10);
  for (const double a : {3., 3.9}) EXPECT_EQ(solved(a, 40).nlp.status, SolveStatus::kLocallyInfeasible) << a;
}

// Least jerk and snap.  On n intervals jerk costs 720 n^4 / (n^4 - 1), a form found by these programs and exact to rounding.
TEST_P(KnownOracles, ChainsOfIntegrators) {
  for (const int n : {2, 3, 5, 10, 20, 40}) {
    const Solved s = solve_on(chain_of_integrators(3, 1, 1), {.intervals = n}, tight(GetParam()));
    const double n4 = double(n) * n * n * n;
    EXPECT_TRUE(s.success()) << n;
    EXPECT_NEAR(s.cost(), 720 * n4 / (n4 - 1), 1e-8) << n;
  }
  for (const auto& [order, d, T, cost] : {std::tuple(3, 1.0, 1.0, 720.0),
                                          {3, 0.3, 2.0, 720 * 0.09 / 32},
                                          {4, 1.0, 1.0, 100800.0},
                                          {4, -2.0, 1.5, 100800 * 4 / std::pow(1.5, 7)}}) {
    const double coarse =
        solve_on(chain_of_integrators(order, d, T), {.intervals = 40}, tight(GetParam())).cost();
    const double fine =
        solve_on(chain_of_integrators(order, d, T), {.intervals = 80}, tight(GetParam())).cost();
    EXPECT_NEAR((coarse - cost) / (fine - cost), 16, 0.1) << order;  // off by the fourth power of the step
    EXPECT_NEAR((16 * fine - coarse) / 15, cost, 5e-9 * cost) << order;
  }
}

// J = ((a^2 + b^2) cosh T - 2 a b) / sinh T: off by the fourth power of the step, u = x' at the ends.
TEST_P(KnownOracles, Catenary) {
  const double a = 1, b = 0.75, J = ((a * a + b * b) * std::cosh(1.) - 2 * a * b) / std::sinh(1.);
  ASSERT_TRUE(has_digits(J, "0.775240441233723"));
  const auto cost = [&](int n) { return solve_on(catenary(), {.intervals = n}, tight(GetParam())).cost(); };
  EXPECT_NEAR((cost(10) - J) / (cost(20) - J), 16, 0.1);
  EXPECT_NEAR(cost(1280), J, 2e-15);
  const Solved s = solve_on(catenary(), {.intervals = 160}, tight(GetParam()));
  EXPECT_NEAR(s.slope_by_start[0], 2 * (a * std::cosh(1.) - b) / std::sinh(1.), 1e-9);
}

TEST_P(KnownOracles, Brachistochrone) {
  for (const auto& [X, Y, g, time] : {std::tuple(10., 5., 9.80665, "1.80160312245308"),
                                      {10., 5., 9.81, "1.80129548301372"},
                                      {2., 2., 9.8, "0.824759143156625"},
                                      {2., 2., 9.81, "0.824338669439184"}}) {
    const double T = std::strtod(time, nullptr);
    double least[3];
    for (int i = 0; i < 3; ++i) {
      const Solved s = solve_on(brachistochrone(X, Y, g), {.intervals = 40 << i}, tight(GetParam()));
      EXPECT_TRUE(s.success()) << to_string(s.nlp.status) << " " << X << " " << (40 << i);
      EXPECT_NEAR(s.duration(), s.cost(), 1e-12);
      // What was fallen through is speed.
      const VectorXd end = s.motion.x.rightCols(1);
      EXPECT_NEAR(end[2] * end[2], 2 * g * Y, 1e-5 * 2 * g * Y);
      least[i] = s.duration();
    }
    EXPECT_NEAR((least[0] - T) / (least[1] - T), 16, 0.3);
    EXPECT_NEAR(least[2], T, 2e-11 * T);
    EXPECT_NEAR((16 * least[2] - least[1]) / 15, T, 1e-13 * T) << time;
  }
}

// Rest to rest in least time is 2 sqrt(d / a): on an even number of intervals the switch is at a node, and nothing is lost.
TEST_P(KnownOracles, LeastTime) {
  for (const auto& [d, a] : {std::pair(1., 1.), {2., 3.}, {0.01, 40.}}) {
    for (const Scheme& scheme : {euler(), hermite_simpson()}) {
      Problem p("bang", {"p", "v"}, {"u"}, 1, [](const auto& s) { return vector(s.x[1], s.u[0]); });
      p.add(minimum_time(1));
      p.free_duration(0.01, 20);
      p.goal << d, 0;
      p.start << 0, 0;
      p.u.lower[0] = -a, p.u.upper[0] = a;
      const Solved s = solve_on(p, {.scheme = scheme, .intervals = 16}, tight(GetParam()));
      EXPECT_TRUE(s.success()) << scheme.name << " " << d << " " << to_string(s.nlp.status);
      EXPECT_NEAR(s.duration(), 2 * std::sqrt(d / a), 1e-10) << scheme.name << " " << d;
    }
  }
}

// (2, 0) to (5, 0), least int (1 + v^2) / 2 over a free time, |u| <= 1: a second each of thrust and brake, between them two of
// coasting, on an arc where nothing but v^2 decides about u.  10/3 and 4 s.
TEST_P(KnownOracles, BangAndCoast) {
  Problem p("coast", {"p", "v"}, {"u"}, 5, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.add(running_cost("time and speed", [](const auto& s) { return (1.0 + s.x[1] * s.x[1]) / 2.0; }));
  p.free_duration(0.5, 20);
  p.start << 2, 0;
  p.goal << 5, 0;
  p.u.lower[0] = -1, p.u.upper[0] = 1;
  for (const Scheme& scheme : {euler(), trapezoid(), hermite_simpson()}) {
    double off[2], late[2];
    for (int i = 0; i < 2; ++i) {
      const Solved s = solve_on(p, {.scheme = scheme, .intervals = 64 << i}, tight(GetParam()));
      EXPECT_TRUE(s.success()) << to_string(s.nlp.status);
      off[i] = std::abs(s.cost() - 10. / 3), late[i] = std::abs(s.duration() - 4);
      EXPECT_NEAR(s.motion.x.row(1).maxCoeff(), 1, 2e-3);
      EXPECT_NEAR(s.motion.control(32 << i, 0)[0], 0, 1e-2) << scheme.name;  // half-way it coasts
    }
    const bool is_simpson = scheme.order == 4;  // which takes the corners of v better by an order
    EXPECT_NEAR(off[0] / off[1], is_simpson ? 8 : 4, 0.1) << scheme.name;
    EXPECT_LT(off[1], is_simpson ? 1e-6 : 2e-4);
    EXPECT_NEAR(late[0] / late[1], 4, 0.2) << scheme.name;
    EXPECT_LT(late[1], 3e-4);
  }
}

// Held controls, one Runge-Kutta step each.  Both problems are linear, so that all of it can be said in closed form.
TEST(KnownOracles, DifferentialDynamicProgramming) {
  for (const int n : {5, 20, 100}) {
    const double weight = 1e4, h = 1. / n;
    Problem p = catenary();
    p.goal << Problem::kFree;
    p.add(terminal_squares("end", [=](const auto& s) { return vector(100. * (s.x[0] - 0.75)); }));
    // Backwards over x_next = x + h u with int (x + u t)^2 + u^2 = h x^2 + h^2 x u + (h^3 / 3 + h) u^2.
    double P = weight, q = -weight * 0.75, c = weight * 0.75 * 0.75;  // cost to go P x^2 + 2 q x + c
    for (int k = 0; k < n; ++k) {
      const double uu = h * h * h / 3 + h + h * h * P, xu = h * h / 2 + h * P, u = h * q;
      c -= u * u / uu, q -= u * xu / uu;
      P += h - xu * xu / uu;
    }
    const DdpSolution s = solve_with_ddp(p, {.intervals = n, .evaluation = test::kInterpreted});
    EXPECT_TRUE(s.success());
    EXPECT_NEAR(s.cost, P + 2 * q + c, 1e-11) << n;
    EXPECT_NEAR(s.adjoint(0, 0), 2 * (P + q), 1e-9);

    // Of the block: least |u|^2 h over (p, v) = A u has Gramian G = A A^T / h, and with springs at the end d (G + 1/W)^-1 d.
    Problem b = block_move();
    b.goal.setConstant(Problem::kFree);
    b.add(
        terminal_squares("end", [](const auto& s) { return vector(100. * (s.x[0] - 1.0), 100. * s.x[1]); }));
    Eigen::Matrix2d G = Eigen::Matrix2d::Identity() / weight;
    for (int k = 0; k < n; ++k) {
      const Eigen::Vector2d a(h * h * (n - k - 0.5), h);
      G += a * a.transpose() / h;
    }
    const DdpSolution block = solve_with_ddp(b, {.intervals = n, .evaluation = test::kInterpreted});
    EXPECT_TRUE(block.success());
    EXPECT_NEAR(block.cost, G.inverse()(0, 0), 1e-9) << n;
  }
}

// The Panda, fingers locked: least int |q''|^2 with torques as controls is the block move in disguise, whatever the inertia.
// The motion at the points, and torques from a recursion that the program does not contain.
class KnownPanda : public ::testing::TestWithParam<NlpMethod> {
 protected:
  Problem problem(DynamicsForm form, double holding = 1) const {
    Problem p = robot_problem(scene_, {.duration = 1, .form = form});
    p.add(squared_accelerations(p, 1));
    p.start << from_, VectorXd::Zero(7);
    p.goal << to_, VectorXd::Zero(7);
    p.guess = [=, this, line = straight_line(p)](double t) {
      Stage<double> s = line(t);
      s.x.tail(7).setZero();
      s.u = holding * holding_torque(scene_, s.x.head(7));
      return s;
    };
    return p;
  }
  // Largest difference to the cubic, and to its torques.
  std::pair<double, double> off(const Trajectory& motion) const {
    dynamics::Data<double> data(scene_.model);
    double q_off = 0, tau_off = 0;
    for (int k = 0; k < motion.points(); ++k) {
      const double s = motion.t[k];
      const VectorXd dq = to_ - from_, q = from_ + dq * (3 * s * s - 2 * s * s * s);
      const VectorXd tau =
          rnea(scene_.model, data, q, VectorXd(dq * (6 * s - 6 * s * s)), VectorXd(dq * (6 - 12 * s)));
      q_off = std::max(q_off, (motion.x.col(k).head(7) - q).cwiseAbs().maxCoeff());
      tau_off = std::max(tau_off, (motion.u.col(k) - tau).cwiseAbs().maxCoeff());
    }
    return {q_off, tau_off};
  }
  const RobotScene scene_{dynamics::load_urdf(dynamics::robot_file("panda"),
                                              {.lock = {"panda_finger_joint1", "panda_finger_joint2"}}),
                          {},
                          {}};
  const VectorXd from_ = (VectorXd(7) << 0, -0.5, 0, -2, 0, 1.5, 0.5).finished(),
                 to_ = (VectorXd(7) << 1, 0.5, -0.5, -1.2, 0.5, 2, -0.5).finished();
};
INSTANTIATE_TEST_SUITE_P(By, KnownPanda, ::testing::Values(NlpMethod::kIpopt, NlpMethod::kRiccati),
                         test::method_name);

TEST_P(KnownPanda, TheBlockInDisguise) {
  for (const DynamicsForm form : {DynamicsForm::kInverse, DynamicsForm::kForward}) {
    // Where the quadratic torques of a mesh alone lead: the value says nothing about that.
    for (const auto& [n, miss] : {std::pair(1, ""), {2, ""}, {5, "12"}, {10, "0.33"}, {20, "0.019"}}) {
      const Solved s = solve_on(problem(form), {.intervals = n}, {.method = GetParam(), .tolerance = 1e-10});
      EXPECT_TRUE(s.success() || s.nlp.status == SolveStatus::kAcceptable) << to_string(s.nlp.status);
      EXPECT_NEAR(s.cost() / 52.68, 1, 1e-11) << n;
      const auto [q, tau] = off(s.motion);
      EXPECT_LT(q, 1e-9) << n;
      EXPECT_LT(tau, 1e-9) << n;
      if (form == DynamicsForm::kInverse) {
        EXPECT_LE(s.nlp.iterations(), 3) << n;
      } else if (*miss) {
        EXPECT_TRUE(has_digits(verify(problem(form), s.motion).miss, miss)) << n;
      }
    }
  }
}

TEST_P(KnownPanda, FromNoTorque) {
  for (const int n : {1, 2, 5, 10}) {
    const Solved s = solve_on(problem(DynamicsForm::kForward, 0), {.intervals = n},
                              {.method = GetParam(), .tolerance = 1e-10});
    EXPECT_NEAR(s.cost() / 52.68, 1, 1e-11) << n;
    EXPECT_LE(s.nlp.iterations(), 60) << n;
  }
}

TEST_P(KnownPanda, OtherSchemesHaveTheirClosedForms) {
  for (const double n : {5., 10.}) {
    for (const auto& [scheme, value] : {std::pair(trapezoid(), 12 * n * n * n / ((n - 1) * (n * n + n - 3))),
                                        {euler(), 12 * n * n / (n * n - 1)}}) {
      const Solved s = solve_on(problem(DynamicsForm::kForward), {.scheme = scheme, .intervals = int(n)},
                                {.method = GetParam(), .tolerance = 1e-10});
      EXPECT_NEAR(s.cost() / (4.39 * value), 1, 1e-11) << scheme.name << " " << n;
    }
  }
}

// Torques that are free at every point are the block move in disguise whatever the scheme; straight ones are not.
TEST_P(KnownPanda, FamiliesAndStraightTorques) {
  for (const Scheme& scheme : {lobatto(5), radau(3)}) {
    const Solved s = solve_on(problem(DynamicsForm::kForward), {.scheme = scheme, .intervals = 2},
                              {.method = GetParam(), .tolerance = 1e-10});
    EXPECT_NEAR(s.cost() / 52.68, 1, 1e-11) << scheme.name;
  }
  for (const auto& [n, off, last_digit] :
       {std::tuple(2, 0.39, 1e-2), {5, 9.9e-2, 1e-3}, {10, 1.6e-2, 1e-3}, {20, 1.3e-3, 1e-4}}) {
    const Solved s = solve_on(problem(DynamicsForm::kForward),
                              {.scheme = scheme_by_name("hermite-simpson-linear"), .intervals = n},
                              {.method = GetParam(), .tolerance = 1e-10});
    EXPECT_TRUE(s.success()) << n;
    EXPECT_NEAR(s.cost() / 52.68 - 1, off, 0.52 * last_digit) << n;
  }
}

}  // namespace
}  // namespace dyntape::known_oracles_test
