// SPDX-License-Identifier: BSD-3-Clause
//
// The swing-up of a cart-pole, whose optima are known to as many digits as stand here: on every mesh, by every scheme,
// and in the limit from Pontryagin's equations, which know nothing of a mesh.  Multi-starts and the finest meshes are
// in tests/full/solves/known_optima.cpp.
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/solve/ddp.h>
#include "interface/control/known_problems.h"

namespace dyntape::known_optima_test {
namespace {

using test::has_digits;
using test::solve_on;
using test::Solved;
using test::swing_up;
using test::swing_up_low;
using test::tight;

class KnownSwingUp : public ::testing::TestWithParam<NlpMethod> {};
INSTANTIATE_TEST_SUITE_P(By, KnownSwingUp, ::testing::Values(NlpMethod::kIpopt, NlpMethod::kRiccati),
                         test::method_name);

TEST_P(KnownSwingUp, BothBasinsOnEveryMesh) {
  struct Row {
    int intervals;
    const char *a, *b;
  };
  for (const auto& [n, a, b] : {Row{20, "58.7026687790", "57.8359969285"},
                                {40, "58.8075758975", "57.9450220610"},
                                {80, "58.8076640408", "57.9447926279"},
                                {160, "58.8076672550", "57.9447810956"}}) {
    const Solved high = solve_on(swing_up(), {.intervals = n}, tight(GetParam()));
    EXPECT_TRUE(high.success() && has_digits(high.cost(), a)) << n;
    const Solved low = solve_on(swing_up_low(), {.intervals = n}, tight(GetParam()));
    EXPECT_TRUE(low.success() && has_digits(low.cost(), b)) << n;
  }
}

TEST_P(KnownSwingUp, TrapezoidAndEuler) {
  struct Row {
    int intervals;
    const char *trapezoidal, *explicit_euler;
  };
  for (const auto& [n, trapezoidal, explicit_euler] :
       {Row{20, "60.682465", "13.639622"}, {80, "58.945299", "42.122496"}, {320, "58.816601", "54.196241"}}) {
    const Solved t = solve_on(swing_up(), {.scheme = trapezoid(), .intervals = n}, tight(GetParam()));
    EXPECT_TRUE(t.success() && has_digits(t.cost(), trapezoidal)) << n;
    const Solved e = solve_on(swing_up(), {.scheme = euler(), .intervals = n}, tight(GetParam()));
    EXPECT_TRUE(e.success() && has_digits(e.cost(), explicit_euler)) << n;
  }
}

// Controls that are straight lines from node to node, under Hermite-Simpson.
TEST_P(KnownSwingUp, StraightControls) {
  for (const auto& [n, cost] :
       {std::pair(20, "58.8169385256"), {40, "58.8125340236"}, {80, "58.8079434"}, {160, "58.8076843"}}) {
    const Solved s = solve_on(
        swing_up(), {.scheme = scheme_by_name("hermite-simpson-linear"), .intervals = n}, tight(GetParam()));
    EXPECT_TRUE(s.success() && has_digits(s.cost(), cost)) << n;
    const Verification v = verify(swing_up(), s.motion);
    EXPECT_LT(v.violation, 1e-9);
    EXPECT_NEAR(s.motion.control(3, 0.25)[0], 0.75 * s.motion.u(0, 6) + 0.25 * s.motion.u(0, 8), 1e-10);
  }
}

// D x = h f at all points of one interval.  On 41 points there are two optima beside each other: from the line the solvers find the
// lower one, from the motion on 21 points that of the reference.
TEST_P(KnownSwingUp, OneLongInterval) {
  const auto solved = [&](int points, const Trajectory* from = nullptr) {
    return solve_on(swing_up(), {.scheme = pseudospectral(points), .intervals = 1},
                    {.method = GetParam(), .tolerance = 1e-10, .bound_relaxation = 0}, from);
  };
  const Solved at_21 = solved(21);
  EXPECT_TRUE(at_21.success() && has_digits(at_21.cost(), "61.3781"));
  for (const auto& [points, cost] : {std::pair(16, "127.0988"), {41, "58.92871"}, {61, "58.808546"}}) {
    const Solved s = solved(points);
    EXPECT_TRUE(s.success() && has_digits(s.cost(), cost)) << points;
    EXPECT_LE(s.nlp.iterations(), 25) << points;
    EXPECT_LT(verify(swing_up(), s.motion).violation, 1e-7) << points;
  }
  const Solved s = solved(41, &at_21.motion);
  EXPECT_TRUE(s.success() && has_digits(s.cost(), "58.95805"));
}

// From few long intervals to many short ones: the limit, with the order of the scheme.
TEST_P(KnownSwingUp, FamiliesOfPoints) {
  struct Row {
    Scheme scheme;
    int intervals;
    double off, ratio;  // of the cost on so many intervals, and by how much less it is on twice as many
  };
  for (const auto& [scheme, n, off, ratio] : {Row{lobatto(5), 40, 1.6e-7, 256},
                                              {radau(2), 80, 1.3e-2, 8},
                                              {radau(3), 80, 9.5e-6, 32},
                                              {radau(5), 40, 3.1e-8, 512}}) {
    const Solved coarse = solve_on(swing_up(), {.scheme = scheme, .intervals = n}, tight(GetParam()));
    const Solved fine =
        solve_on(swing_up(), {.scheme = scheme, .intervals = 2 * n}, tight(GetParam()), &coarse.motion);
    EXPECT_TRUE(coarse.success() && fine.success()) << scheme.name;
    EXPECT_LE(fine.nlp.iterations(), 16) << scheme.name;
    const double limit = 58.8076674582, before = std::abs(coarse.cost() - limit),
                 after = std::abs(fine.cost() - limit);
    EXPECT_LT(before, off) << scheme.name;
    EXPECT_LT(after, 1.3 * before / ratio + 3e-10) << scheme.name << " " << before << " " << after;
  }
}

TEST_P(KnownSwingUp, TheOtherWayRound) {
  Problem p = swing_up();
  p.goal[1] = -test::kPi;
  p.guess = straight_line(p);
  const Solved s = solve_on(p, {.intervals = 80}, tight(GetParam()));
  EXPECT_TRUE(s.success());
  EXPECT_TRUE(has_digits(s.cost(), "82.376164"));
}

// The costates at t = 0 are the derivatives of the optimum by the start, here from the multipliers.  Their error falls with the
// fourth power of the step: two meshes give the limit.
TEST_P(KnownSwingUp, CostatesAreThoseOfPontryagin) {
  const Eigen::Vector4d high(3.61895528, -52.00121901, 4.85047653, 4.28990482),
      low(6.30590297, -35.56180763, 4.34130579, -4.69049443);
  for (const auto& [problem, costates, limit] :
       {std::tuple(swing_up(), high, "58.80766746"), std::tuple(swing_up_low(), low, "57.94478031")}) {
    const Solved coarse = solve_on(problem, {.intervals = 160}, tight(GetParam()));
    const Solved fine = solve_on(problem, {.intervals = 320}, tight(GetParam()), &coarse.motion);
    ASSERT_TRUE(coarse.success() && fine.success());
    EXPECT_LE(fine.nlp.iterations(), 16);  // from the motion on the coarser mesh; from the line up to 69
    EXPECT_TRUE(has_digits((16 * fine.cost() - coarse.cost()) / 15, limit));
    const Eigen::VectorXd extrapolated = (16 * fine.slope_by_start - coarse.slope_by_start) / 15;
    EXPECT_LT((extrapolated - costates).cwiseAbs().maxCoeff(), 1e-8) << extrapolated.transpose();
    // u = -lambda . B / 2 with B = (0, 0, 1 / m1, -1 / (m1 l)) where the pole hangs; its error falls with the square of the
    // step, and what two meshes leave of it with the third power.
    const double u = (4 * fine.motion.u(0, 0) - coarse.motion.u(0, 0)) / 3;
    EXPECT_NEAR(u, -(costates[2] - costates[3] / 0.5) / 2, 4e-5);
  }
}

// Where the controls alone lead, from the start: the reference's digits.
TEST(KnownSwingUp, MissesOfTheControls) {
  struct Row {
    Scheme scheme;
    int intervals;
    double miss, last_digit;
  };
  for (const auto& [scheme, n, miss, last_digit] : {Row{hermite_simpson(), 20, 0.710, 1e-3},
                                                    {hermite_simpson(), 40, 1.36e-2, 1e-4},
                                                    {hermite_simpson(), 80, 8.39e-4, 1e-6},
                                                    {hermite_simpson(), 160, 5.24e-5, 1e-7},
                                                    {trapezoid(), 20, 6.0, 0.1},
                                                    {trapezoid(), 80, 0.508, 1e-3},
                                                    {trapezoid(), 320, 3.07e-2, 1e-4},
                                                    {euler(), 20, 4.2, 0.1},
                                                    {euler(), 80, 4.9, 0.1},
                                                    {euler(), 320, 8.8, 0.1}}) {
    const Solved s = solve_on(swing_up(), {.scheme = scheme, .intervals = n}, tight(NlpMethod::kRiccati));
    const Verification v = verify(swing_up(), s.motion);
    EXPECT_NEAR(v.miss, miss, 0.52 * last_digit) << scheme.name << " " << n;
    EXPECT_LT(v.violation, 1e-9);
  }
}

TEST_P(KnownSwingUp, TightLimitsOfTheForce) {
  struct Row {
    double limit;
    const char* cost;
  };
  for (const auto& [limit, cost] : {Row{12, "57.970766"},
                                    {10, "58.853703"},
                                    {9, "60.306845"},
                                    {8, "63.791263"},
                                    {7, "78.489145"},
                                    {6.87, "89.21"}}) {
    const Solved s = solve_on(swing_up_low(limit), {.intervals = 40}, tight(GetParam()));
    EXPECT_TRUE(s.success()) << limit << ": " << to_string(s.nlp.status);
    EXPECT_TRUE(has_digits(s.cost(), cost)) << limit;
    EXPECT_LE(s.motion.u.cwiseAbs().maxCoeff(), limit);
  }
  for (const auto& [limit, cost] : {Row{12, "59.198680"}, {10, "62.264592"}, {9, "68.487404"}}) {
    const Solved s = solve_on(swing_up(0, limit), {.intervals = 40}, {.method = GetParam()});
    EXPECT_TRUE(s.success()) << limit << ": " << to_string(s.nlp.status);
    EXPECT_TRUE(has_digits(s.cost(), cost)) << limit;
  }
}

// From the line no swing-up is found below 9 N although there is one: what is said must not deny that.
TEST_P(KnownSwingUp, InfeasibleIsSaidToBeLocal) {
  for (const double limit : {8., 6.}) {
    const Solved from_line =
        solve_on(swing_up(0, limit), {.intervals = 40}, {.method = GetParam(), .try_other_method = false});
    EXPECT_EQ(from_line.nlp.status, SolveStatus::kLocallyInfeasible) << limit;
    // Where there is a motion, a start beside the line finds it.
    const Solved beside = solve_on(swing_up(0, limit), {.intervals = 40}, {.method = GetParam()});
    EXPECT_EQ(beside.nlp.status, limit > 6.5 ? SolveStatus::kSolved : SolveStatus::kLocallyInfeasible)
        << limit;
    const Solved from_b = solve_on(swing_up_low(limit), {.intervals = 40}, {.method = GetParam()});
    EXPECT_EQ(from_b.nlp.status, limit > 6.5 ? SolveStatus::kSolved : SolveStatus::kLocallyInfeasible)
        << limit;
  }
  const std::string said = describe(SolveStatus::kLocallyInfeasible);
  EXPECT_NE(said.find("locally"), std::string::npos) << said;
}

// With the goal as a cost of weight W at the end the optimum falls short by |costates at the end|^2 / 4 W, and held controls
// are off by the square of the step: both are made up for.
TEST(KnownSwingUp, DifferentialDynamicProgrammingComesToTheSame) {
  const double weight = 1e6;
  for (const auto& [hard, limit] :
       {std::pair(swing_up(), 58.8076674582), std::pair(swing_up_low(), 57.9447803067)}) {
    const Trajectory near = solve_on(hard, {.intervals = 40}, {.method = NlpMethod::kRiccati}).motion;
    Problem p = hard;
    p.x.lower.setConstant(-HUGE_VAL), p.x.upper.setConstant(HUGE_VAL);
    p.goal.setConstant(Problem::kFree);
    p.add(terminal_squares("goal", [=, goal = hard.goal](const auto& s) {
      auto off = s.x;
      for (Eigen::Index i = 0; i < off.size(); ++i) off[i] = std::sqrt(weight) * (s.x[i] - goal[i]);
      return off;
    }));
    p.guess = [near](double t) {
      const int k = std::min(int(20 * t + 1e-9), 39);
      const double r = 20 * t - k;
      const Eigen::VectorXd x = (1 - r) * near.x.col(2 * k) + r * near.x.col(2 * k + 2);
      return Stage<double>{t, x, {}, near.control(k, r)};
    };
    double cost[2], short_of = 0;
    for (int i = 0; i < 2; ++i) {
      const DdpSolution s = solve_with_ddp(
          p, {.intervals = 200 << i, .start = DdpStart::kNodes, .evaluation = test::kInterpreted});
      ASSERT_TRUE(s.success()) << to_string(s.status);
      EXPECT_TRUE(s.is_minimum);
      cost[i] = s.cost;
      short_of = s.adjoint.rightCols(1).squaredNorm() / (4 * weight);
    }
    EXPECT_NEAR((4 * cost[1] - cost[0]) / 3 + short_of, limit, 5e-6) << cost[0] << " " << cost[1];
  }
}

}  // namespace
}  // namespace dyntape::known_optima_test
