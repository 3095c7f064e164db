// SPDX-License-Identifier: BSD-3-Clause
//
// solve(): meshes are refined until the motion is true, and "solved" is not said of what is none: rows passed between points, stationary
// points without curvature, costs that the quadrature misses, motions that nominal values hide.  The right values are closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/solve.h>
#include "interface/interpreted.h"

namespace dyntape::solve_test {
namespace {

using Eigen::VectorXd;
using test::kInterpreted;

SolveOptions on(int intervals, NlpMethod method = NlpMethod::kRiccati, Scheme scheme = hermite_simpson()) {
  SolveOptions options;
  options.mesh = {.scheme = std::move(scheme), .intervals = intervals, .evaluation = kInterpreted};
  options.solver.method = method;
  return options;
}

SolveOptions fixed(SolveOptions options) {
  options.refinements = 0;
  return options;
}

Problem integrator(double duration = 1) {
  Problem p("integrator", {"x"}, {"u"}, duration, [](const auto& s) { return vector(s.u[0]); });
  p.start << 0;
  return p;
}

// From one side of a disc to the other, its centre a little beside the straight line.  `form`: of the distance d that the row is of.
enum class Form { kDistance, kSquare, kInverse };
Problem past_a_disc(Form form, double length) {
  Problem p("point", {"x", "y"}, {"u", "w"}, 1, [](const auto& s) { return vector(s.u[0], s.u[1]); });
  p.start << 0, 0, p.goal << 2 * length, 0;
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  const double r = 0.2 * length;
  const auto value = [=](const auto& s) {
    using std::sqrt;
    const auto dx = s.x[0] - 0.93 * length, dy = s.x[1] + 0.01 * length;
    const auto d2 = dx * dx + dy * dy;
    using T = std::decay_t<decltype(d2)>;
    return vector(form == Form::kDistance ? T(sqrt(d2)) : form == Form::kSquare ? T(d2) : T(-1.0 / d2));
  };
  const double least = form == Form::kDistance ? r : form == Form::kSquare ? r * r : -1 / (r * r);
  p.add(path_inequality("keep out", value, VectorXd::Constant(1, least), VectorXd::Constant(1, HUGE_VAL)));
  p.guess = [length](double t) {
    return Stage<double>{t,
                         Eigen::Vector2d(2 * length * t, 0.3 * length * std::sin(3.14159265 * t)),
                         {},
                         Eigen::Vector2d(0, 0)};
  };
  return p;
}

double nearest(const Problem& problem, const Solution& s, double length) {
  std::vector<double> times;
  for (int i = 0; i <= 20000; ++i) times.push_back(i / 20000.0);
  const Trajectory fine = resampled(problem, s.motion, times);
  double least = HUGE_VAL;
  for (int i = 0; i < fine.points(); ++i)
    least = std::min(least, std::hypot(fine.x(0, i) - 0.93 * length, fine.x(1, i) + 0.01 * length));
  return least;
}

TEST(Solve, NoMotionPassesAnObstacleBetweenPoints) {
  for (const Form form : {Form::kDistance, Form::kSquare, Form::kInverse}) {
    for (const double length : {1.0, 100.0}) {
      const Problem p = past_a_disc(form, length);
      const Solution coarse = solve(p, fixed(on(5, NlpMethod::kIpopt, trapezoid())));
      EXPECT_TRUE(coarse.converged());
      EXPECT_LT(nearest(p, coarse, length), 0.19 * length);
      EXPECT_FALSE(coarse.success());
      EXPECT_NE(coarse.verdict().find("between points"), std::string::npos) << coarse.verdict();
      const Solution fine = solve(p, on(10));
      EXPECT_TRUE(fine.success()) << int(form) << " " << length << " " << fine.verdict();
      EXPECT_GT(nearest(p, fine, length), (0.2 - 1e-3) * length) << int(form);
    }
  }
}

TEST(Solve, NoBoundIsPassedBetweenPoints) {
  Problem p("block", {"p", "v"}, {"u"}, 1, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.start << 0, 0, p.goal << 1, 0;
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.x.lower << -5, -1.2, p.x.upper << 5, 1.2;
  const Solution coarse = solve(p, fixed(on(2)));
  EXPECT_TRUE(coarse.converged());
  EXPECT_FALSE(coarse.success());
  const Solution fine = solve(p, on(2));
  EXPECT_TRUE(fine.success()) << fine.verdict();
  EXPECT_GT(fine.meshes.size(), 1u);
  for (int k = 0; k + 1 < fine.motion.points(); ++k)
    EXPECT_LT(MotionBetween(p, fine.motion).at(k, 0.5).x[1], 1.2 + 2e-3);
}

// Zero slope and zero curvature at the guess; the least is -1.  u^4 has its least there.
TEST(Solve, StationaryPointsWithoutCurvatureAreLookedAlong) {
  using Cost = std::function<Problem()>;
  const auto running = [](auto cost) {
    return [cost] {
      Problem p = integrator();
      p.u.lower << -1, p.u.upper << 1;
      p.add(running_cost("c", cost));
      return p;
    };
  };
  const Cost fourth = running([](const auto& s) { return vector(-(s.u[0] * s.u[0] * s.u[0] * s.u[0])); });
  const Cost third = running([](const auto& s) { return vector(s.u[0] * s.u[0] * s.u[0]); });
  const Cost minimum = running([](const auto& s) { return vector(s.u[0] * s.u[0] * s.u[0] * s.u[0]); });
  const Cost rate = [] {
    Problem p("cubed", {"x"}, {"u"}, 1, [](const auto& s) { return vector(s.u[0] * s.u[0] * s.u[0]); });
    p.start << 0;
    p.u.lower << -1, p.u.upper << 1;
    p.add(terminal_cost("far", [](const auto& s) { return vector(-s.x[0]); }));
    return p;
  };
  for (const auto& [make, least] : {std::pair{fourth, -1.}, {third, -1.}, {rate, -1.}, {minimum, 0.}}) {
    for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
      const Solution s = solve(make(), fixed(on(20, method)));
      EXPECT_TRUE(s.converged() && is_optimal(s.kkt, s.nlp.stationary_point, s.demands)) << s.verdict();
      EXPECT_NEAR(s.cost(), least, 1e-3);
    }
    const DdpSolution d = solve_with_ddp(make(), {.intervals = 20, .evaluation = kInterpreted});
    EXPECT_TRUE(d.success()) << to_string(d.status);
    EXPECT_NEAR(d.cost, least, 1e-3);
  }
}

// The farthest point of a triangle: from the middle of its long side a solve falls into one of two corners.  Each stage has flat
// directions beside the curved ones, since controls hardly cost.
TEST(Solve, ASaddleIsLeftInFewIterations) {
  Problem p("corner", {"x", "y"}, {"u", "w"}, 1, [](const auto& s) { return vector(s.u[0], s.u[1]); });
  p.start << 2, 2;
  p.add(terminal_cost("far", [](const auto& s) { return vector(-(s.x[0] * s.x[0] + s.x[1] * s.x[1])); }));
  p.add(terminal_inequality(
      "sum", [](const auto& s) { return vector(s.x[0] + s.x[1]); }, VectorXd::Constant(1, -HUGE_VAL),
      VectorXd::Constant(1, 10)));
  p.add(running_cost("effort", [](const auto& s) { return vector(1e-9 * s.u.dot(s.u)); }));
  p.x.lower << 0, 0, p.x.upper << 100, 100;
  const Solution s = solve(p, on(20, NlpMethod::kRiccati, radau(3)));
  EXPECT_TRUE(s.success()) << s.verdict();
  EXPECT_NEAR(s.cost(), -100, 1e-4);
  EXPECT_LE(s.iterations(), 60);
}

// A pulse in the cost that no point meets: to stay costs 35.4.
TEST(Solve, CostsAreIntegratedWithTheMotion) {
  Problem p = integrator();
  p.add(running_cost("pulse", [](const auto& s) {
    using std::exp;
    const auto w = (s.t - 0.512) / 0.002;
    const auto off = s.x[0] - 1.0;
    return vector(s.u[0] * s.u[0] + 1e4 * exp(-(w * w)) * off * off);
  }));
  const Solution s = solve(p, fixed(on(20)));
  EXPECT_TRUE(s.converged());
  EXPECT_FALSE(s.success());
  EXPECT_NEAR(s.verification.true_cost, 1e4 * 0.002 * std::sqrt(3.14159265358979), 0.01);
  EXPECT_NE(s.verdict().find("costs 35.4"), std::string::npos) << s.verdict();
}

// The weight of u^2 jumps between a node of every mesh and the first point behind it: no point has the first weight there, so finer
// meshes do not change the cost.  u is inverse to the weight: 1 / (at + (1 - at) / 10).
TEST(Solve, ACostThatJumpsBehindANodeIsResolved) {
  constexpr double kAt = 0.503;
  Problem p = integrator();
  p.goal << 1;
  p.add(running_cost("jump", [](const auto& s) {
    using T = std::decay_t<decltype(s.u[0])>;
    T weight;
    if constexpr (std::is_same_v<T, double>)
      weight = s.t < kAt ? 1 : 10;
    else
      weight = select(s.t < kAt, T(1), T(10));
    return vector(T(weight * s.u[0] * s.u[0]));
  }));
  const double optimum = 1 / (kAt + (1 - kAt) / 10);
  for (const NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
    const Solution s = solve(p, on(20, method, radau(3)));
    EXPECT_TRUE(s.success()) << s.verdict();
    EXPECT_NEAR(s.cost() / optimum, 1, 1e-3);
  }
}

// A geodesic of the half-plane whose metric is by the height: cosh T = 1 + 2^2 / 2.  The heading has no bounds, and enters by its sine and
// cosine alone: no point of the solution is whole turns from its neighbour, and the first step is no turn long.
TEST(Solve, AHeadingWithoutBoundsDoesNotSpin) {
  Problem p("geodesic", {"x", "y"}, {"heading"}, 1, [](const auto& s) {
    using std::cos, std::sin;
    return vector(s.x[1] * cos(s.u[0]), s.x[1] * sin(s.u[0]));
  });
  p.start << 0, 1, p.goal << 2, 1;
  p.add(minimum_time(1.0));
  p.free_time = Problem::Range{0.1, 20};
  for (const NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
    const Solution s = solve(p, on(20, method, radau(3)));
    EXPECT_TRUE(s.success()) << s.verdict();
    EXPECT_NEAR(s.cost(), std::acosh(3), 1e-4);
    EXPECT_LT(s.meshes.front().iterations, 20);
    // A start several turns away stays right at its points, and is unwound.
    StagedNlp nlp(discretize(p, on(20, method, radau(3)).mesh));
    std::vector<double> x = nlp.variables(resampled(p, s.motion, nlp.times())), turned = x;
    for (std::size_t i = 3; i < turned.size(); i += 8) turned[i] += 6.283185307179586 * double(i % 5);
    const std::vector<double> unwound = without_turns(nlp, turned);
    for (std::size_t i = 11; i < unwound.size(); i += 4)
      EXPECT_LT(std::abs(unwound[i] - unwound[i - 4]), 3.2);
  }
}

// The first guess of a control is the number within its bounds that is nearest to 0: the square root has no slope there.
TEST(Solve, TheFirstGuessIsWithinBounds) {
  Problem p = integrator();
  p.goal << 4;
  p.u.lower << 0.01, p.u.upper << 100;
  p.add(running_cost("gain", [](const auto& s) {
    using std::sqrt;
    return vector(-sqrt(s.u[0]));
  }));
  SolveOptions options = on(20);
  options.check_derivatives = false;  // its differences reach below zero
  const Solution s = solve(p, options);
  EXPECT_TRUE(s.success()) << s.verdict();
  EXPECT_NEAR(s.cost(), -2, 1e-4);
}

// 12 d^2 / T^3 in each half; the control jumps between them.
TEST(Solve, ControlsJumpWhereAConstraintStands) {
  for (const double share : {0.5, 0.3}) {
    Problem p("halves", {"p", "v"}, {"u"}, 1, [](const auto& s) { return vector(s.x[1], s.u[0]); });
    p.start << 0, 0, p.goal << 1, 0;
    p.add(running_squares("effort", [](const auto& s) { return s.u; }));
    p.add(at_fraction(share, path_equality("rest", [](const auto& s) { return vector(s.x[1]); })));
    // With d at the share: 12 (d^2 / share^3 + (1 - d)^2 / (1 - share)^3), least over d.
    const double a = 1 / std::pow(share, 3), b = 1 / std::pow(1 - share, 3);
    const Solution s = solve(p, on(20));
    EXPECT_TRUE(s.success()) << s.verdict();
    EXPECT_NEAR(s.cost() / (12 * a * b / (a + b)), 1, 1e-3);
    EXPECT_LT(s.cost_change, 1e-4);
  }
}

TEST(Solve, NominalValuesHideNoMotion) {
  for (const double k : {1e3, 1e4, 1e6}) {
    Problem p("stiff", {"x"}, {"u"}, 1, [k](const auto& s) {
      using std::cos;
      return vector(-k * (s.x[0] - cos(s.t)) + s.u[0]);
    });
    p.start << 0;
    p.add(running_squares("effort", [](const auto& s) { return s.u; }));
    const Solution s = solve(p, fixed(on(10, NlpMethod::kRiccati, scheme_by_name("runge-kutta-4"))));
    EXPECT_TRUE(!s.success() || s.cost() < 1e-3) << k << " " << s.cost();
  }
}

TEST(Solve, AGuessFarAwayHasTheSameDerivatives) {
  Problem p("far", {"p", "v"}, {"u"}, 1, [](const auto& s) {
    using std::sin;
    return vector(s.x[1], s.u[0] - sin(3 * s.x[0]));
  });
  p.start << 0, 0, p.goal << 1, 0;
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.guess = [](double t) {
    return Stage<double>{t, Eigen::Vector2d(1e6, -1e6), {}, VectorXd::Constant(1, 1e6)};
  };
  EXPECT_NO_THROW(solve(p, fixed(on(20))));
}

// On a fine mesh a barrier of 0.1 for each of some thousand bounds outweighs the cost: the solve left the motion that it started from.
TEST(Solve, AFinerMeshStaysAtTheMotionItStartsFrom) {
  Problem p = past_a_disc(Form::kDistance, 1);
  p.x = {Eigen::Vector2d(-3, -3), Eigen::Vector2d(5, 5)};
  p.u = {Eigen::Vector2d(-20, -20), Eigen::Vector2d(20, 20)};
  for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
    std::vector<std::vector<double>> costs;  // of each solve
    SolveOptions options = on(20, method, radau(3));
    options.cost_change = 1e-7;  // many meshes
    options.solver.watch = [&](const IterationRecord& record) {
      if (record.iteration == 0) costs.emplace_back();
      costs.back().push_back(record.objective);
    };
    const Solution s = solve(p, options);
    EXPECT_TRUE(s.success()) << s.verdict();
    ASSERT_GE(s.meshes.size(), 3u);
    ASSERT_GE(costs.size(), 3u);
    for (std::size_t k = 1; k < costs.size(); ++k)
      EXPECT_LE(*std::max_element(costs[k].begin(), costs[k].end()), 1.01 * costs[k].front()) << k;
    for (std::size_t k = 1; k < s.meshes.size(); ++k) EXPECT_LE(s.meshes[k].iterations, 15) << k;
  }
}

TEST(Ddp, SuccessIsOfTheMotionThatTheControlsMake) {
  Problem p("pulse", {"x"}, {"u"}, 1, [](const auto& s) {
    using std::exp;
    const auto w = (s.t - 0.513) / 1e-3;
    return vector(s.u[0] + 1000 * exp(-(w * w)));
  });
  p.start << 0;
  p.add(running_squares("effort", [](const auto& s) { return vector(std::sqrt(1e-3) * s.u[0]); }));
  p.add(terminal_squares("end", [](const auto& s) { return vector(s.x[0]); }));
  const DdpSolution s = solve_with_ddp(p, {.intervals = 10, .evaluation = kInterpreted});
  EXPECT_TRUE(s.converged());
  EXPECT_FALSE(s.success());
  EXPECT_NEAR(s.integration_error, std::sqrt(3.14159265358979), 1e-3);
}

// Every control of the same mean is a minimum; with a cost of effort one is.
TEST(Ddp, SensitivitiesNeedAStrictMinimum) {
  for (const double effort : {0.0, 1e-3}) {
    Problem p = integrator();
    const auto goal = p.parameters.add("g", 1.0);
    p.add(terminal_squares("end", [goal](const auto& s) { return vector(s.x[0] - goal(s)[0]); }));
    if (effort > 0)
      p.add(
          running_squares("effort", [effort](const auto& s) { return vector(std::sqrt(effort) * s.u[0]); }));
    const DdpSolution s = solve_with_ddp(
        p, {.intervals = 5, .evaluation = kInterpreted, .sensitivities = SensitivitiesOf::kMotion});
    EXPECT_TRUE(s.success());
    EXPECT_EQ(s.sensitivities.good(), effort > 0) << to_string(s.sensitivities.status);
  }
}

// On the top of a double well: 60 there, 7.3 in a well.
TEST(Mpc, TheFirstPlanIsNoMaximum) {
  Problem p = integrator(2);
  p.add(running_squares("u", [](const auto& s) { return s.u; }));
  p.add(running_squares("well",
                        [](const auto& s) { return vector(std::sqrt(30.0) * (s.x[0] * s.x[0] - 1.0)); }));
  RecedingHorizon mpc(p, {.mesh = {.scheme = trapezoid(),
                                   .intervals = 20,
                                   .hessian = HessianKind::kGaussNewton,
                                   .evaluation = kInterpreted}});
  const MpcStep& s = mpc.step(0, VectorXd::Zero(1));
  EXPECT_TRUE(s.usable && s.is_minimum);
  EXPECT_LT(s.cost, 8);
}

}  // namespace
}  // namespace dyntape::solve_test
