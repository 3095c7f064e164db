// SPDX-License-Identifier: BSD-3-Clause
//
// Terms at single instants: the start, waypoints.  Against splines, which are the motions of least effort through points.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/control/problem/phases.h>
#include <dyntape/interface/control/sensitivity/motion_sensitivities.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::instants_test {
namespace {

using Eigen::VectorXd;

// Least int u^2 of p'' = u, rest to rest over `distance`, through `place` where a share of the duration has passed: a clamped
// cubic spline with one node between, whose slope there is known.
double spline_effort(double distance, double duration, double share, double place) {
  const double h1 = share * duration, h2 = duration - h1, d1 = place, d2 = distance - place;
  const double v = 1.5 * (d1 / (h1 * h1) + d2 / (h2 * h2)) / (1 / h1 + 1 / h2);
  const auto effort = [v](double d, double h) {
    return 12 * d * d / (h * h * h) - 12 * d * v / (h * h) + 4 * v * v / h;
  };
  return effort(d1, h1) + effort(d2, h2);
}

StageFunction off(double place) {
  return [place](const auto& s) { return vector(std::decay_t<decltype(s.t)>(s.x[0] - place)); };
}

Problem through(double share, double place, double distance = 1, double duration = 1) {
  Problem p = test::block_move(distance, duration);
  p.add(at_fraction(share, path_equality("via", off(place))));
  return p;
}

OptimiseOptions by(NlpMethod method, int intervals) {
  return {.mesh = {.intervals = intervals, .evaluation = test::kInterpreted}, .solver = {.method = method}};
}

// Hermite-Simpson has such splines exactly, with an even mesh or one whose node has moved.
TEST(Instants, AWaypointIsThatOfASpline) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> share(0.05, 0.95), place(-2, 2);
  for (int trial = 0; trial < 20; ++trial) {
    const double s = trial == 0 ? 0.5 : share(random), y = place(random), T = 0.5 + trial;
    for (NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
      const Solution found = optimise(through(s, y, 1, T), by(method, 7));
      const double expected = spline_effort(1, T, s, y);
      ASSERT_TRUE(found.success()) << trial;
      EXPECT_NEAR(found.cost(), expected, 1e-6 * expected) << "seed 3, trial " << trial;
      EXPECT_NEAR(found.verification.cost, expected, 1e-6 * expected) << trial;
    }
  }
}

// A waypoint that is only drawn to: the distance that stays is known as well.
TEST(Instants, ASoftWaypointWeighsItsDistance) {
  const double weight = 30, share = 0.4, wanted = 2;
  Problem p = test::block_move();
  p.add(soft(at_fraction(share, path_equality("via", off(wanted))), Quadratic{weight}));
  // J(y) is a parabola through three points; so is what is minimised.
  const double a = spline_effort(1, 1, share, 0), b = spline_effort(1, 1, share, 1),
               c = spline_effort(1, 1, share, 2);
  const double square = (c - 2 * b + a) / 2, slope = b - a - square;
  const double y = (2 * weight * wanted - slope) / (2 * (square + weight));
  const double cost = a + slope * y + square * y * y + weight * (y - wanted) * (y - wanted);
  for (HessianKind kind : {HessianKind::kExact, HessianKind::kGaussNewton}) {
    OptimiseOptions options = by(NlpMethod::kRiccati, 10);
    options.mesh.hessian = kind;
    const Solution found = optimise(p, options);
    ASSERT_TRUE(found.success());
    EXPECT_NEAR(found.cost(), cost, 1e-7 * cost);
    EXPECT_NEAR(found.motion.x(0, found.motion.node(4)), y, 1e-6);
  }
}

// The share stays what it is where the duration is found: w T + C / T^3 is least at T = (3 C / w)^(1/4).
TEST(Instants, KeepTheirShareOfAFreeDuration) {
  const double weight = 50, share = 0.3, place = 0.8, C = spline_effort(1, 1, share, place);
  Problem p = through(share, place);
  p.free_duration(0.2, 8);
  p.add(minimum_time(weight));
  for (NlpMethod method : {NlpMethod::kRiccati, NlpMethod::kIpopt}) {
    const Solution found = optimise(p, by(method, 10));
    ASSERT_TRUE(found.success());
    const double T = found.motion.t[found.motion.points() - 1];
    EXPECT_NEAR(T, std::pow(3 * C / weight, 0.25), 1e-5 * T);
    EXPECT_NEAR(found.motion.t[found.motion.node(3)], share * T, 1e-9);
    EXPECT_NEAR(found.motion.x(0, found.motion.node(3)), place, 1e-8);
  }
}

// The same as two phases that meet there.
TEST(Instants, AreWhatTwoPhasesSay) {
  const double place = 0.9;
  Problem first = test::block_move(), second = first;
  first.duration = 0.25, second.duration = 0.75;
  first.goal << place, Problem::kFree;
  second.start << Problem::kFree, Problem::kFree;
  Phases phases("two");
  phases.add("to", first), phases.add("from", second);
  const Solution two = optimise(phases, {.meshes = {{.intervals = 4, .evaluation = test::kInterpreted}},
                                         .solver = {.method = NlpMethod::kRiccati}});
  const Solution one = optimise(through(0.25, place), by(NlpMethod::kRiccati, 8));
  ASSERT_TRUE(one.success());
  EXPECT_NEAR(one.cost(), two.nlp.objective, 1e-7 * one.cost());
}

// Every kind of term at the start, at an instant that the mesh has and one for which a node moves.
Problem with_terms_at_instants() {
  Problem p = test::swing_up(1.0);
  const auto bend = [](const auto& s) {
    using std::cos;
    return cos(s.x[1]) * s.x[3] + s.t * s.u[0] * s.u[0] * s.x[0];
  };
  const auto both = [](const auto& s) { return vector(s.x[0] * s.x[1], s.u[0] + s.x[2] * s.x[2]); };
  for (double share : {0., 0.41, 0.75}) {
    const std::string at = std::to_string(share);
    p.add(at_fraction(share, running_cost("cost " + at, bend)));
    p.add(at_fraction(
        share, path_inequality("between " + at, both, Eigen::Vector2d(-9, -9), Eigen::Vector2d(9, 9))));
    p.add(at_fraction(share, running_squares("squares " + at, both)));
  }
  p.add(at_fraction(0.75, path_equality("via", bend)));
  p.add(terminal_inequality("tip", both, Eigen::Vector2d(-9, -9), Eigen::Vector2d(9, 9)));
  return p;
}

TEST(Instants, DerivativesAndNames) {
  for (const char* scheme : {"euler", "trapezoid", "hermite-simpson"}) {
    Problem p = with_terms_at_instants();
    for (bool is_free : {false, true}) {
      if (is_free) p.free_duration(1, 4);
      StagedNlp nlp =
          discretize(p, {.scheme = scheme_by_name(scheme), .intervals = 8, .evaluation = test::kInterpreted});
      std::mt19937_64 random(5);
      std::normal_distribution<double> normal;
      std::vector<double> x = nlp.start();
      for (double& v : x) v += 0.3 * normal(random);
      const DerivativeCheck check = check_derivatives(nlp, x);
      EXPECT_TRUE(check.good()) << scheme << ": " << (check.good() ? "" : check.mismatches[0].row);
      const std::size_t m = nlp.shape().m();
      EXPECT_EQ(nlp.constraint_name(m - 1), "tip[1] at the end");
      EXPECT_EQ(nlp.constraint_name(m - 3), "via at 0.75 of the duration");
      EXPECT_EQ(nlp.constraint_name(m - 9), "between 0.000000[0] at the start");
    }
  }
}

// A row of the program, of the audit and of its nominal values are one: what an audit finds of a motion that is none is what the
// program says of it.
TEST(Instants, TheAuditCountsTheSameRows) {
  const Problem p = with_terms_at_instants();
  StagedNlp nlp = discretize(p, {.intervals = 8, .evaluation = test::kInterpreted});
  const std::vector<double> x = nlp.start();
  std::vector<double> g(nlp.shape().m());
  double cost = 0, worst = 0;
  ASSERT_TRUE(nlp.constraints(x.data(), g.data()) && nlp.objective(x.data(), cost));
  for (std::size_t j = 0; j < g.size(); ++j)
    worst = std::max({worst, nlp.shape().g_lower[j] - g[j], g[j] - nlp.shape().g_upper[j]});
  const Verification found = verify(p, nlp.trajectory(x));
  EXPECT_NEAR(found.cost, cost, 1e-10 * std::abs(cost));
  EXPECT_NEAR(found.violation, worst, 1e-10 * worst);
  EXPECT_EQ(nlp.scaling(x).g.size(), g.size());
}

TEST(Instants, AMeshHasANodeThere) {
  Problem p = through(0.5, 0.1);
  const std::vector<double> plain = node_times(test::block_move(), {.intervals = 10});
  EXPECT_EQ(node_times(p, {.intervals = 10}), plain);  // to the bit: it has one there
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> share(0, 1);
  for (int trial = 0; trial < 500; ++trial) {
    Problem many = test::block_move(1, 2.5);
    const int n = 1 + int(random() % 5), intervals = n + 1 + int(random() % 20);
    for (int k = 0; k < n; ++k) many.add(at_fraction(share(random), path_equality("via", off(0))));
    const std::vector<double> nodes = node_times(many, {.intervals = intervals});
    ASSERT_EQ(nodes.size(), std::size_t(intervals) + 1);
    for (double s : instants_of(many)) EXPECT_NEAR(nodes[node_at_share(many, s, nodes)], 2.5 * s, 1e-8);
  }
  // Refined meshes keep their nodes.
  StagedNlp nlp = discretize(through(1. / 3, 0.4), {.intervals = 5, .evaluation = test::kInterpreted});
  EXPECT_NO_THROW(discretize(nlp, halved(nlp.trajectory(nlp.start()))));
}

TEST(Instants, WhatHasNoneIsToldSo) {
  const auto said = [](const auto& f) { return message_of<ArgumentError>(f); };
  const Problem p = through(0.3, 0.1);
  EXPECT_EQ(said([&] {
              node_times(p, {.nodes = {0, 0.25, 0.5, 1}});
            }).find("nothing"),
            0u);  // known at a program
  EXPECT_EQ(said([&] {
              discretize(p, {.nodes = {0, 0.25, 0.5, 1}, .evaluation = test::kInterpreted});
            }),
            "problem \"block move\": the term \"via\" is at 0.3 of the duration, where the mesh has no node; "
            "expected one, and the nearest is at 0.25 of the duration");
  EXPECT_EQ(said([&] { node_times(p, {.intervals = 1}); }),
            "problem \"block move\": terms are at 1 instants between start and end, and the mesh has 1 "
            "intervals; expected 2 at least");
  EXPECT_NE(said([] { at_fraction(1.2, path_equality("via", off(0))); }).find("expected a share from 0 to 1"),
            std::string::npos);
  EXPECT_NE(said([&] { RecedingHorizon mpc(p); }).find("recedes with the horizon and is never reached"),
            std::string::npos);
  Problem drawn = test::block_move();
  drawn.goal.setConstant(Problem::kFree);
  drawn.add(at_fraction(0.5, running_squares("via", off(0))));
  EXPECT_NE(
      said([&] {
        solve_with_ddp(drawn, {.evaluation = test::kInterpreted});
      }).find("the term \"via\" is at 0.5 of the duration, which steps from stage to stage do not know"),
      std::string::npos);
}

// d cost / d place of a waypoint, against the spline.
TEST(Instants, SolutionsHaveSlopesByAWaypoint) {
  Problem p = test::block_move();
  const Parameter place = p.parameters.add("place", 0.7);
  p.add(at_fraction(0.4, path_equality("via", [place](const auto& s) {
                      return vector(std::decay_t<decltype(s.t)>(s.x[0] - place(s)[0]));
                    })));
  const MeshOptions mesh{.intervals = 10, .evaluation = test::kInterpreted};
  StagedNlp nlp = discretize(p, mesh);
  const NlpSolution solution = solve_with_riccati(nlp, nlp.start(), {});
  MotionSensitivity sensitivity(p, mesh);
  const MotionSensitivities derivatives = sensitivity.at(p, solution);
  const double h = 1e-4;
  const double expected = (spline_effort(1, 1, 0.4, 0.7 + h) - spline_effort(1, 1, 0.4, 0.7 - h)) / (2 * h);
  EXPECT_NEAR(derivatives.parameters.cost[0], expected, 1e-5 * std::abs(expected));
}

// At the start of a horizon a term acts on what the plant does now: its first force is drawn to that of before.
TEST(Instants, ATermAtTheStartOfAHorizon) {
  Problem p = test::block_move();
  p.goal.setConstant(Problem::kFree);
  p.add(running_squares("near", [](const auto& s) { return vector(10.0 * (s.x[0] - 1.0), 0.0 * s.x[0]); }));
  p.add(at_start(
      running_squares("now", [](const auto& s) { return (1e3 * (s.u.array() - 2.0)).matrix().eval(); })));
  MpcOptions options;
  options.mesh.intervals = 10, options.mesh.evaluation = test::kInterpreted;
  RecedingHorizon mpc(p, options);
  const MpcStep& s = mpc.step(0, Eigen::Vector2d(0, 0));
  ASSERT_TRUE(s.usable);
  EXPECT_NEAR(s.plan.motion.u(0, 0), 2, 1e-3);
}

}  // namespace
}  // namespace dyntape::instants_test
