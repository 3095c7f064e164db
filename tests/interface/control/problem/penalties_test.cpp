// SPDX-License-Identifier: BSD-3-Clause
//
// Soft terms: their values and derivatives against formulas, what Gauss-Newton knows of them, and what they become as they harden.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/problem/penalties.h>
#include <dyntape/interface/control/problem/record_stage.h>
#include <dyntape/interface/control/solve/ddp.h>
#include "autodiff/dense.h"
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::penalties_test {
namespace {

using Eigen::VectorXd;

const double kInfinity = HUGE_VAL;

StageFunction all_states() {
  return [](const auto& s) { return s.x; };
}
VectorXd one(double value) { return VectorXd::Constant(1, value); }

// A scalar function of one number with its first and second derivative.
struct Slopes {
  double value, first, second;
};

// The cost of a term at r, as the recorded program has it.
Slopes cost_at(const Term& term, double r) {
  const Function f = record("cost", 1, [&](const VectorXad& x) {
    Stage<AD> s;
    s.x = x;
    const VectorXad values = term.function(s);
    AD sum(0);
    for (const AD& v : values) sum += term.role == Role::kSquares ? v * v : v;
    return VectorXad(VectorXad::Constant(1, sum));
  });
  Stage<double> s{0, one(r), {}, {}};
  const VectorXd plain = term.function(s);
  const double value = term.role == Role::kSquares ? plain.squaredNorm() : plain.sum();
  return {value, testing::jacobian(f, {r})(0, 0), testing::hessian(f, {r}, {1.0})(0, 0)};
}

// The curvature of a square s^2 is 2 s'^2 + 2 s s'', two numbers as large as the slope over r that far away cancel: known to the
// rounding of these.
void expect_near(const Slopes& found, const Slopes& expected, const std::string& where, double r = 1) {
  const auto near = [&](double a, double b, double rounding, const char* what) {
    EXPECT_LE(std::abs(a - b), 1e-11 * std::abs(b) + rounding + 1e-300)
        << what << where << ": " << a << " or " << b;
  };
  near(found.value, expected.value, 0, "value ");
  near(found.first, expected.first, 0, "slope ");
  near(found.second, expected.second, r == 0 ? 0 : 3e-15 * std::abs(expected.first / r), "curvature ");
}

// In 64 digits of mantissa, and where differences of large numbers are written without them.
Slopes huber(long double r, long double w, long double d) {
  const long double y = r / d, root = sqrtl(1 + y * y);
  return {double(2 * w * r * r / (root + 1)), double(2 * w * r / root), double(2 * w / (root * root * root))};
}

std::vector<double> some_numbers(double seam, std::mt19937_64& random) {
  std::uniform_real_distribution<double> decade(-6, 6), sign(-1, 1);
  std::vector<double> r = {0,      seam,    -seam, std::nextafter(seam, 1), std::nextafter(-seam, -1),
                           1e-100, -1e-100, 1e60};
  for (int k = 0; k < 40; ++k) r.push_back(std::copysign(seam * std::pow(10, decade(random)), sign(random)));
  return r;
}

TEST(Penalties, AreTheirFormulasWithAllSlopes) {
  constexpr unsigned kSeed = 8;
  std::mt19937_64 random(kSeed);
  const Term zero = path_equality("zero", all_states());
  for (double width : {1e-3, 0.2, 50.}) {
    for (double r : some_numbers(width, random)) {
      const std::string where = "at " + std::to_string(r) + ", width " + std::to_string(width);
      expect_near(cost_at(soft(zero, Quadratic{3}), r), {3 * r * r, 6 * r, 6}, "of a square " + where);
      expect_near(cost_at(soft(zero, Huber{2, width}), r), huber(r, 2, width), "of Huber " + where, r);
      expect_near(cost_at(soft(zero, SmoothAbsolute{4, width}), r), huber(r, 2 / width, width),
                  "of |r| " + where, r);
    }
  }
  // What the names promise.
  EXPECT_NEAR(cost_at(soft(zero, SmoothAbsolute{3, 1e-6}), -7).value, 21, 1e-5);
  EXPECT_NEAR(cost_at(soft(zero, Huber{3, 1e3}), 0.1).value, 0.03, 1e-8);
}

TEST(Penalties, OfAnInequalityCountWhatLiesBeyond) {
  const Term between = path_inequality("between", all_states(), one(-1), one(2));
  for (const Penalty& p : {Penalty(Quadratic{3}), Penalty(Huber{3, 0.1}), Penalty(SmoothAbsolute{3, 0.1})}) {
    const Term zero = path_equality("zero", all_states());
    for (double r : {-1., -0.3, 0., 1.9, 2.}) expect_near(cost_at(soft(between, p), r), {0, 0, 0}, "within");
    for (double off : {1e-8, 0.1, 3.}) {
      const Slopes above = cost_at(soft(between, p), 2 + off), below = cost_at(soft(between, p), -1 - off);
      const Slopes of_above = cost_at(soft(zero, p), (2 + off) - 2),
                   of_below = cost_at(soft(zero, p), (-1 - off) + 1);
      expect_near(above, of_above, "above"), expect_near(below, of_below, "below");
    }
  }
}

Slopes barrier(double h, double mu, double delta) {
  if (h > delta) return {-mu * std::log(h), -mu / h, mu / (h * h)};
  const double y = (h - 2 * delta) / delta;
  return {mu / 2 * (y * y - 1) - mu * std::log(delta), mu * y / delta, mu / (delta * delta)};
}

TEST(Penalties, ARelaxedBarrierIsItsFormulaOnBothSidesAndAtTheSeam) {
  std::mt19937_64 random(9);
  const double mu = 0.3;
  for (double delta : {1e-3, 0.5}) {
    for (double h : some_numbers(delta, random)) {
      const Term term =
          soft(path_inequality("above", all_states(), one(0), one(kInfinity)), RelaxedBarrier{mu, delta});
      const Slopes expected = barrier(h, mu, delta), found = cost_at(term, h);
      const std::string where = " at " + std::to_string(h);
      EXPECT_NEAR(found.value, expected.value, 1e-12 * (std::abs(expected.value) + 1)) << where;
      EXPECT_NEAR(found.first, expected.first, 1e-12 * std::abs(expected.first)) << where;
      EXPECT_NEAR(found.second, expected.second, 1e-12 * std::abs(expected.second)) << where;
      // Gauss-Newton's curvature is the barrier's own.
      const Function c = record("c", 1, [&](const VectorXad& x) {
        Stage<AD> s;
        s.x = x;
        return term.curvature(s);
      });
      const double slope = testing::jacobian(c, {h})(0, 0);
      EXPECT_NEAR(2 * slope * slope, expected.second, 1e-12 * expected.second) << where;
    }
  }
  // Both bounds count, those at infinity do not.
  const Term both = soft(path_inequality("both", all_states(), one(-1), one(3)), RelaxedBarrier{mu, 0.1});
  expect_near(cost_at(both, 0.5),
              {barrier(1.5, mu, 0.1).value + barrier(2.5, mu, 0.1).value,
               barrier(1.5, mu, 0.1).first - barrier(2.5, mu, 0.1).first,
               barrier(1.5, mu, 0.1).second + barrier(2.5, mu, 0.1).second},
              "between two");
}

TEST(Penalties, KeepPlaceAndName) {
  const Term end = soft(terminal_equality("end", all_states()), Quadratic{});
  EXPECT_EQ(end.where, Where::kTerminal);
  EXPECT_EQ(end.name, "end");
  const Term via =
      soft(at_fraction(0.25, path_inequality("via", all_states(), one(0), one(1))), RelaxedBarrier{});
  EXPECT_EQ(via.where, Where::kInstant);
  EXPECT_EQ(via.share, 0.25);
  EXPECT_EQ(via.role, Role::kCost);
}

TEST(Penalties, WrongOnesAreRefusedInOneSentence) {
  const Term cost = running_cost("fuel", [](const auto&s) { return s.x[0]; }),
             zero = path_equality("zero", all_states());
  const auto refused = [](const Term& term, const Penalty& p) {
    return message_of<ArgumentError>([&] { soft(term, p); });
  };
  EXPECT_EQ(refused(cost, Quadratic{}),
            "the term \"fuel\" is a cost already; expected an inequality, an equality or squares "
            "to make soft");
  EXPECT_EQ(refused(zero, RelaxedBarrier{}),
            "the soft term \"zero\" has a barrier and no bounds; expected an inequality, or another penalty");
  EXPECT_EQ(refused(zero, Huber{1, 0}),
            "the soft term \"zero\" has a width of 0, expected a positive number");
  EXPECT_EQ(refused(zero, Quadratic{-1}),
            "the soft term \"zero\" has a weight of -1, expected a positive number");
  Problem p = test::block_move();
  p.add(soft(path_inequality("two", all_states(), one(0), one(1)), Quadratic{}));
  EXPECT_EQ(message_of<ArgumentError>([&] { discretize(p, {.evaluation = test::kInterpreted}); }),
            "the soft term \"two\" has 2 entries, its bounds have 1 and 1");
}

// A block that may not be quick: the bound itself, or a barrier before it.
Problem slow_block(std::optional<Penalty> penalty, double most = 1.2) {
  Problem p = test::block_move();
  const Term slow = path_inequality(
      "slow", [](const auto& s) { return vector(s.x[1]); }, one(-kInfinity), one(most));
  p.add(penalty ? soft(slow, *penalty) : slow);
  return p;
}

// As the barrier shrinks the motion goes to that with the bound: by mu, whichever curvature and solver is used.
TEST(Penalties, ASoftLimitBecomesTheHardOne) {
  for (HessianKind kind : {HessianKind::kExact, HessianKind::kGaussNewton}) {
    OptimiseOptions options{.mesh = {.intervals = 20, .hessian = kind, .evaluation = test::kInterpreted},
                            .solver = {.method = NlpMethod::kRiccati}};
    const Solution hard = optimise(slow_block({}), options);
    ASSERT_TRUE(hard.success());
    double before = HUGE_VAL;
    for (double mu : {1e-1, 1e-2, 1e-3, 1e-4}) {
      const Solution found = optimise(slow_block(RelaxedBarrier{mu, mu / 10}), options);
      ASSERT_TRUE(found.success()) << mu;
      const double off = (found.motion.x - hard.motion.x).cwiseAbs().maxCoeff();
      EXPECT_LT(off, before / 2) << mu;
      EXPECT_LT(found.motion.x.row(1).maxCoeff(), 1.2 + mu) << mu;
      before = off;
    }
    EXPECT_LT(before, 2e-3);
  }
}

TEST(Penalties, EveryKindOfHessianFindsTheSameMotion) {
  for (const Penalty& p :
       {Penalty(Quadratic{1e3}), Penalty(Huber{1e3, 0.02}), Penalty(SmoothAbsolute{30, 0.01})}) {
    std::vector<double> costs;
    for (HessianKind kind : {HessianKind::kExact, HessianKind::kGaussNewton}) {
      const Solution s = optimise(
          slow_block(p), {.mesh = {.intervals = 20, .hessian = kind, .evaluation = test::kInterpreted}});
      ASSERT_TRUE(s.success()) << p.index();
      costs.push_back(s.cost());
    }
    EXPECT_NEAR(costs[0], costs[1], 1e-6 * costs[0]) << p.index();
    EXPECT_GT(costs[0], 12) << p.index();
  }
}

// Differential dynamic programming has no rows, but takes barriers: iLQR, which knows their curvature, and exact Hessians find
// the same.
TEST(Penalties, DifferentialDynamicProgrammingTakesBarriers) {
  Problem p = slow_block(RelaxedBarrier{1e-2, 1e-3});
  p.goal.setConstant(Problem::kFree);
  p.add(terminal_squares("end", [](const auto& s) { return vector(10.0 * (s.x[0] - 1.0), 10.0 * s.x[1]); }));
  std::vector<double> costs;
  for (DdpHessian kind : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
    const DdpSolution s =
        solve_with_ddp(p, {.intervals = 50, .hessian = kind, .evaluation = test::kInterpreted});
    ASSERT_TRUE(s.success());
    EXPECT_LT(s.x.row(1).maxCoeff(), 1.2 + 1e-3);  // the limit, and delta: without it it is 1.5
    costs.push_back(s.cost);
  }
  EXPECT_NEAR(costs[0], costs[1], 1e-6 * costs[0]);
}

// Model predictive control with one Gauss-Newton step a plan and a speed limit that a push breaks: the barrier lets it begin
// where the limit is broken, and brings it back.
TEST(Penalties, ABarrierHoldsInModelPredictiveControlThroughAPush) {
  Problem p("slow", {"p", "v"}, {"u"}, 0.5, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.add(running_squares("near", [](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(3.0 * (s.x[0] - 2.0)), T(0.1 * s.u[0]));
  }));
  p.add(soft(path_inequality(
                 "slow", [](const auto& s) { return vector(s.x[1]); }, one(-0.5), one(0.5)),
             RelaxedBarrier{1e-2, 1e-3}));
  p.start << 0, 0;
  MpcOptions options;
  options.mesh.intervals = 25, options.mesh.evaluation = test::kInterpreted;
  options.iterations = 1;
  RecedingHorizon mpc(p, options);
  VectorXd x = Eigen::Vector2d(0, 0);
  double fastest = 0;
  for (int k = 0; k < 300; ++k) {
    const MpcStep& s = mpc.step(0.02 * k, x);
    ASSERT_TRUE(s.usable) << k;
    x = simulate(p, x, 0, 0.02, [&](double after) { return s.plan.control(0.02 * k + after); }).x;
    if (k == 60) x[1] += 0.6;  // far beyond the limit
    if (k < 60 || k > 90) fastest = std::max(fastest, std::abs(x[1]));
  }
  EXPECT_LT(fastest, 0.5);
  EXPECT_GT(fastest, 0.4);
  EXPECT_NEAR(x[0], 2, 1e-2);
}

}  // namespace
}  // namespace dyntape::penalties_test
