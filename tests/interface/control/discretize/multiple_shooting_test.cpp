// SPDX-License-Identifier: BSD-3-Clause
//
// Multiple shooting: the optimum of differential dynamic programming by the same steps, steps written out once more, and
// closed forms for controls that are held.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/sensitivity/motion_sensitivities.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/known_problems.h"
#include "interface/message_of.h"

namespace dyntape::multiple_shooting_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr NlpMethod kMethods[] = {NlpMethod::kIpopt, NlpMethod::kRiccati};

// A swing-up with a soft goal, pushed by a wind that varies with time, past a reference that does; squares, or plain costs.
Problem in_the_wind(bool of_squares, double force_limit) {
  Parameters parameters;
  const Parameter wind =
      parameters.add("wind", [](double t) { return VectorXd::Constant(1, 0.5 * std::sin(4 * t)); });
  const Parameter target =
      parameters.add("target", [](double t) { return Eigen::Vector2d(0.5 * t, std::cos(t)); });
  Problem p("cart-pole in the wind", {"p", "th", "pd", "thd"}, {"u"}, 2.0, [wind](const auto& s) {
    auto pushed = s;
    pushed.u[0] = s.u[0] + wind(s)[0];
    return test::cart_pole_rate()(pushed);
  });
  p.parameters = parameters;
  const auto near = [target](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    const auto at = target(s);
    return vector(T(s.x[0] - at[0]), T(0.3 * (s.x[1] - at[1]) * s.t));
  };
  if (of_squares)
    p.add(running_squares("near", near));
  else
    p.add(running_cost("near", [near](const auto& s) { return near(s).squaredNorm(); }));
  test::swing_up_softly(p, 10, force_limit);
  return p;
}

// From the motion that it found itself, as both find minima near their start.
TEST(MultipleShooting, HasTheOptimaOfDifferentialDynamicProgramming) {
  for (const auto& [scheme, name] : {std::pair(ShootingScheme::kRungeKutta4, "runge-kutta-4"),
                                     {ShootingScheme::kEuler, "semi-implicit-euler"}}) {
    for (const bool of_squares : {true, false}) {
      for (const double limit : {HUGE_VAL, 8.}) {
        Problem p = in_the_wind(of_squares, limit);
        p.positions = 2;
        const DdpSolution d = solve_with_ddp(
            p, {.intervals = 60, .scheme = scheme, .tolerance = 1e-13, .evaluation = test::kInterpreted});
        ASSERT_TRUE(d.converged() || d.status == SolveStatus::kAcceptable) << to_string(d.status);
        p.guess = [&d, &p](double t) {
          const long k = std::lround(t / p.duration * 60);
          return Stage<double>{t, d.x.col(k), {}, d.u.col(std::min(k, 59l))};
        };
        for (const NlpMethod method : kMethods) {
          const Solution s = optimise(
              p, {.mesh = {.scheme = scheme_by_name(name), .intervals = 60, .evaluation = test::kInterpreted},
                  .solver = {.method = method, .tolerance = 1e-13, .bound_relaxation = 0}});
          ASSERT_TRUE(s.converged() || s.nlp.status == SolveStatus::kAcceptable) << to_string(s.nlp.status);
          EXPECT_LE(s.nlp.iterations(), 20) << name;
          EXPECT_NEAR(s.cost(), d.cost, 1e-9 * d.cost) << name << " " << of_squares << " " << limit;
          EXPECT_LT((s.motion.x - d.x).cwiseAbs().maxCoeff(), 1e-9 * d.x.cwiseAbs().maxCoeff()) << name;
          EXPECT_LT((s.motion.u.leftCols(60) - d.u).cwiseAbs().maxCoeff(), 1e-7) << name;
          EXPECT_NEAR(s.verification.cost, s.cost(), 1e-10 * d.cost);
          EXPECT_LT(s.verification.violation, 1e-9);
          EXPECT_NEAR(s.verification.worst_defect, d.integration_error, 1e-8);
        }
      }
    }
  }
}

// From a guess that is no motion, with a goal and limits of states, which steps from stage to stage do not know.
TEST(MultipleShooting, SwingsUpToAGoal) {
  const double limit = 58.8076674582;
  for (const NlpMethod method : kMethods) {
    double off[2];
    for (int i = 0; i < 2; ++i) {
      const test::Solved s = test::solve_on(
          test::swing_up(), {.scheme = runge_kutta_4(1), .intervals = 80 << i}, test::tight(method));
      ASSERT_TRUE(s.success()) << to_string(s.nlp.status);
      off[i] = s.cost() - limit;
      const Verification v = verify(test::swing_up(), s.motion);
      EXPECT_LT(v.violation, 1e-9);
      EXPECT_LT(v.worst_defect, i == 0 ? 4e-5 : 1.5e-6);  // of the steps: of the fourth order and more
    }
    std::printf("held controls cost %.5f and %.5f more on 80 and 160 intervals\n", off[0], off[1]);
    EXPECT_NEAR(off[0] / off[1], 4, 0.3);  // of the second order, however exact the steps are
  }
}

// Classical Runge-Kutta steps once more, `steps` an interval: the nodes and the cost of a solution.
TEST(MultipleShooting, StepsAreThoseWrittenOutOnceMore) {
  const Problem p = in_the_wind(true, 8);
  for (const int steps : {1, 2, 5}) {
    const std::vector<double> nodes = {0, 0.2, 0.5, 0.9, 1.0, 1.3, 1.6, 2.0};
    const Solution s = optimise(
        p, {.mesh = {.scheme = runge_kutta_4(steps), .nodes = nodes, .evaluation = test::kInterpreted},
            .solver = {.method = NlpMethod::kRiccati, .tolerance = 1e-12}});
    ASSERT_TRUE(s.converged()) << to_string(s.nlp.status);
    const auto rate = [&](double t, const VectorXd& x, const VectorXd& u) -> VectorXd {
      const Stage<double> stage = p.stage(t, x.head(4), {}, u);
      VectorXd all(5);
      all << p.rate(stage),
          p.terms[0].function(stage).squaredNorm() + p.terms[1].function(stage).squaredNorm();
      return all;
    };
    VectorXd x = VectorXd::Zero(5);
    for (int k = 0; k + 1 < int(nodes.size()); ++k) {
      const VectorXd u = s.motion.u.col(k);
      EXPECT_EQ(s.motion.control(k, 0.7), u);
      EXPECT_LT((s.motion.x.col(k) - x.head(4)).norm(), 1e-10) << steps << " " << k;
      const double h = (nodes[std::size_t(k) + 1] - nodes[std::size_t(k)]) / steps;
      for (int i = 0; i < steps; ++i) {
        const double t = nodes[std::size_t(k)] + i * h;
        const VectorXd k1 = rate(t, x, u), k2 = rate(t + h / 2, x + h / 2 * k1, u),
                       k3 = rate(t + h / 2, x + h / 2 * k2, u), k4 = rate(t + h, x + h * k3, u);
        x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      }
    }
    const VectorXd end = p.terms[2].function(p.stage(2, x.head(4), {}, VectorXd::Zero(1)));
    EXPECT_NEAR(s.cost(), x[4] + end.squaredNorm(), 1e-9 * s.cost()) << steps;
  }
}

// Held controls that move a block: 12 d^2 / T^3 N^2 / (N^2 - 1), by steps of order two or more at every N.
TEST(MultipleShooting, ABlockMovesAsHeldControlsCan) {
  for (const NlpMethod method : kMethods) {
    for (const double n : {2., 5., 20.}) {
      for (const int steps : {1, 3}) {
        const test::Solved s =
            test::solve_on(test::block_move(1.5, 2), {.scheme = runge_kutta_4(steps), .intervals = int(n)},
                           test::tight(method));
        ASSERT_TRUE(s.success());
        EXPECT_NEAR(s.cost(), 12 * 2.25 / 8 * n * n / (n * n - 1), 1e-9) << n;
        EXPECT_LT(verify(test::block_move(1.5, 2), s.motion).miss, 1e-9);
      }
    }
  }
}

// c / T^3 + w T is least at T^4 = 3 c / w, c of held controls.
TEST(MultipleShooting, ADurationIsFound) {
  Problem p = test::block_move(1.5);
  p.add(minimum_time(4));
  p.free_duration(0.2, 10);
  const double n = 8, c = 12 * 2.25 * n * n / (n * n - 1);
  for (const NlpMethod method : kMethods) {
    for (const HessianKind hessian : {HessianKind::kExact, HessianKind::kGaussNewton}) {
      const test::Solved s =
          test::solve_on(p, {.scheme = runge_kutta_4(1), .intervals = int(n), .hessian = hessian},
                         {.method = method, .tolerance = 1e-10});
      ASSERT_TRUE(s.success());
      EXPECT_NEAR(s.duration(), std::pow(3 * c / 4, 0.25), 1e-7);
      const Verification v = verify(p, s.motion);
      EXPECT_LT(v.violation, 1e-7);
      EXPECT_LT(v.miss, 1e-7);
      EXPECT_NEAR(v.cost, s.cost(), 1e-6);
    }
  }
}

// A plan follows a reference of time whose later values a step asks for on the way.
TEST(MultipleShooting, PlansFollowAReference) {
  const Problem p = test::follower(1.5);
  MpcOptions options;
  options.mesh = {.scheme = runge_kutta_4(1), .intervals = 30, .hessian = HessianKind::kGaussNewton};
  options.mesh.evaluation = test::kInterpreted;
  options.iterations = 1;
  RecedingHorizon mpc(p, options);
  VectorXd x = Eigen::Vector2d(0.3, 0);
  double worst = 0;
  for (int k = 0; k < 100; ++k) {
    const double t = 0.05 * k;
    const MpcStep& s = mpc.step(t, x);
    ASSERT_TRUE(s.usable) << k;
    x = simulate(p, x, 0, 0.05, [&](double after) { return s.plan.control(t + after); }).x;
    if (t > 1) worst = std::max(worst, std::abs(x[0] - std::sin(t + 0.05)));
  }
  EXPECT_LT(worst, 0.01);
}

TEST(MultipleShooting, WhatItDoesNotKnowIsRefused) {
  Problem inverse = test::block_move();
  inverse.rate = [](const auto& s) { return vector(s.x[1], s.a[0]); };
  inverse.use_accelerations(
      {"a"}, [](const auto& s) { return s.u[0] - s.a[0]; }, inverse.ode);
  const MeshOptions mesh{.scheme = runge_kutta_4(1), .intervals = 5, .evaluation = test::kInterpreted};
  EXPECT_EQ(
      message_of<ArgumentError>([&] { discretize(inverse, mesh); }),
      "problem \"block move\": the dynamics are in their inverse form, which steps do not know; expected "
      "the forward form");
  EXPECT_EQ(
      message_of<ArgumentError>([&] { MotionSensitivity(in_the_wind(true, 8), mesh); }),
      "problem \"cart-pole in the wind\": the parameter \"wind\" varies with time, on the way of a step as "
      "well, which derivatives of multiple shooting do not know; expected constants");
  Problem odd = test::block_move();
  odd.rate = [](const auto& s) { return s.u; };
  EXPECT_EQ(message_of<ArgumentError>([&] { discretize(odd, mesh); }),
            "problem \"block move\": the rate has 1 entries, expected one a state: 2");
  Problem wide = test::block_move();
  wide.add(running_cost("wide", [](const auto& s) { return s.x; }));
  EXPECT_EQ(message_of<ArgumentError>([&] { discretize(wide, mesh); }),
            "problem \"block move\": the cost \"wide\" has 2 entries, expected a scalar");
  for (const std::vector<double>& nodes :
       {std::vector<double>{0, 0}, {0, std::nan(""), 1}, {0, 0.5, 0.5, 1}}) {
    MeshOptions odd_mesh = mesh;
    odd_mesh.nodes = nodes;
    EXPECT_NE(message_of<ArgumentError>([&] {
                discretize(test::block_move(), odd_mesh);
              }).find("increasing node times"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace dyntape::multiple_shooting_test
