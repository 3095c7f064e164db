// SPDX-License-Identifier: BSD-3-Clause
//
// Slopes of solutions of small programs, where they are known: of what is held, of bound multipliers, of costs, and how far they
// reach.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/riccati/interior_point.h>
#include <dyntape/interface/control/sensitivity/solution_sensitivities.h>
#include "interface/control/recorded_nlp.h"
#include "interface/message_of.h"

namespace dyntape::solution_sensitivities_test {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using test::RecordedNlp;

NlpSolution solved(Nlp& nlp, double tolerance = 1e-10) {
  return solve_with_riccati(nlp, std::vector<double>(nlp.shape().n(), 0.3),
                            {.tolerance = tolerance, .bound_relaxation = 0});
}

// (x0 - 3)^2 + (x1 - 1)^2 + x0 x1 with x0 <= 1: x1 = 1 - x0 / 2, and the bound multiplier of the bound is 2 (3 - x0) - x1.
TEST(SolutionSensitivities, OfAVariableThatRestsOnItsBound) {
  RecordedNlp nlp(
      [](const VectorXad& x) {
        return VectorXad(
            VectorXad::Constant(1, (x[0] - 3) * (x[0] - 3) + (x[1] - 1) * (x[1] - 1) + x[0] * x[1]));
      },
      2, {}, {});
  nlp.bound(0, -4, 1);
  SolutionSensitivities derivatives(nlp, solved(nlp));
  ASSERT_TRUE(derivatives.good()) << derivatives.why();
  EXPECT_EQ(derivatives.held_variables(), std::vector<std::size_t>{0});
  const SolutionStep s = derivatives.along(Vector2d(1, 7), VectorXd());  // the 7 is of a free variable
  EXPECT_NEAR(s.x[0], 1, 1e-12);
  EXPECT_NEAR(s.x[1], -0.5, 1e-12);
  EXPECT_NEAR(s.bound_multiplier[0], -2 + 0.5, 1e-12);
  EXPECT_NEAR(s.cost, -3.5, 1e-12);     // minus the bound multiplier, 2 (3 - 1) - 1/2
  EXPECT_NEAR(s.to, 3.5 / 1.5, 1e-12);  // there the bound multiplier is gone
  EXPECT_NEAR(s.from, -5, 1e-8);        // there the bounds meet
}

// A row instead of a bound, an equality, and a row that is far away: all bounds move.
TEST(SolutionSensitivities, OfRowsAndTheirPrices) {
  RecordedNlp nlp(
      [](const VectorXad& x) {
        VectorXad y(4);
        y << x[0] * x[0] + 2. * x[1] * x[1] + 3. * x[2] * x[2] - 10. * x[0], x[0] + x[1], x[0] + x[1] + x[2],
            x[0] - x[2];
        return y;
      },
      3, {-HUGE_VAL, 2, -20}, {1.5, 2, HUGE_VAL});
  const NlpSolution s = solved(nlp);
  SolutionSensitivities derivatives(nlp, s);
  ASSERT_TRUE(derivatives.good()) << derivatives.why();
  EXPECT_EQ(derivatives.held_rows(), std::vector<std::size_t>{0});
  // x0 + x1 = a, x2 = b - a: least x0^2 + 2 (a - x0)^2 - 10 x0, x0 = (10 + 4 a) / 6.
  const SolutionStep by_a = derivatives.along(VectorXd::Zero(3), Eigen::Vector3d(1, 0, 0)),
                     by_b = derivatives.along(VectorXd::Zero(3), Eigen::Vector3d(0, 1, 0)),
                     by_far = derivatives.along(VectorXd::Zero(3), Eigen::Vector3d(0, 0, 1));
  EXPECT_LT((by_a.x - Eigen::Vector3d(2 / 3.0, 1 / 3.0, -1)).norm(), 1e-12);
  EXPECT_LT((by_b.x - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_NEAR(by_a.cost, -s.lambda[0], 1e-8);
  EXPECT_NEAR(by_b.cost, -s.lambda[1], 1e-8);
  EXPECT_NEAR(by_b.lambda[1], -6, 1e-12);  // of -6 x2
  EXPECT_EQ(by_far.x.norm(), 0);
  EXPECT_NEAR(by_far.to, s.x[0] - s.x[2] + 20, 1e-7);         // the far row's bound arrives
  EXPECT_NEAR(by_a.to, s.lambda[0] / -by_a.lambda[0], 1e-7);  // there its bound multiplier is gone
}

// A general right side is the inverse of a symmetric matrix.
TEST(SolutionSensitivities, SolvesAreTheirOwnTranspose) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal;
    const auto random = [&](Eigen::Index n) {
      return VectorXd::NullaryExpr(n, [&] { return normal(engine); }).eval();
    };
    const VectorXd c = random(5), r = random(5);
    RecordedNlp nlp(
        [&](const VectorXad& x) {
          VectorXad y(3);
          y.setConstant(AD(0));
          for (int i = 0; i < 5; ++i) {
            y[0] +=
                (x[i] - c[i]) * (x[i] - c[i]) + 0.1 * x[i] * x[i] * x[i] * x[i] + 0.3 * x[i] * x[(i + 1) % 5];
            y[1] += r[i] * x[i];
            y[2] += x[i] * x[i];
          }
          return y;
        },
        5, {0.2, -HUGE_VAL}, {0.2, 0.7});
    nlp.bound(1, -0.3, 0.3);
    SolutionSensitivities derivatives(nlp, solved(nlp));
    ASSERT_TRUE(derivatives.good()) << seed << derivatives.why();
    const VectorXd a = random(5), b = random(2), d = random(5), e = random(2);
    const SolutionStep s = derivatives.solve(a, b), t = derivatives.solve(d, e);
    VectorXd da = d, ad = a;
    for (std::size_t i : derivatives.held_variables()) da[Eigen::Index(i)] = ad[Eigen::Index(i)] = 0;
    VectorXd eb = e, be = b;
    if (derivatives.held_rows().empty()) eb[1] = be[1] = 0;
    EXPECT_NEAR(s.x.dot(da) + s.lambda.dot(eb), t.x.dot(ad) + t.lambda.dot(be),
                1e-11 * (1 + s.x.norm() + s.lambda.norm()))
        << seed;
  }
}

// Between the derivatives of both sides where a bound has no bound multiplier; either side alone is good.
TEST(SolutionSensitivities, LieBetweenThoseOfBothSides) {
  for (const double place : {0.7, 1.0, 1.3}) {
    RecordedNlp nlp(
        [&](const VectorXad& x) { return VectorXad(VectorXad::Constant(1, (x[0] - x[1]) * (x[0] - x[1]))); },
        2, {}, {});
    nlp.bound(0, -HUGE_VAL, 1), nlp.bound(1, place, place);
    for (const double tolerance : {1e-6, 1e-8, 1e-12}) {
      SolutionSensitivities derivatives(nlp, solved(nlp, tolerance));
      const double slope = derivatives.along(Vector2d(0, 1), VectorXd()).x[0];
      EXPECT_EQ(derivatives.status(),
                place == 1 ? SensitivityStatus::kWeaklyActive : SensitivityStatus::kGood)
          << tolerance;
      if (place != 1) {
        EXPECT_NEAR(slope, place < 1 ? 1 : 0, 1e-12);
      } else {
        EXPECT_GT(slope, 0.1);
        EXPECT_LT(slope, 0.9);
        EXPECT_EQ(derivatives.weak_variables(), std::vector<std::size_t>{0});
      }
    }
  }
}

TEST(SolutionSensitivities, RefuseAndFlag) {
  const auto square = [](const VectorXad& x) {
    return VectorXad(VectorXad::Constant(1, x[0] * x[0] - x[1] * x[1]));
  };
  RecordedNlp nlp(square, 2, {}, {});
  NlpSolution saddle;
  saddle.x = {0, 0}, saddle.lower_multiplier = {0, 0}, saddle.upper_multiplier = {0, 0};
  SolutionSensitivities derivatives(nlp, saddle);
  EXPECT_EQ(derivatives.status(), SensitivityStatus::kNoStrictMinimum);
  EXPECT_TRUE(std::isnan(derivatives.along(Vector2d(0, 0), VectorXd()).x[0]));
  EXPECT_EQ(message_of<ArgumentError>([&] { derivatives.along(VectorXd::Zero(3), VectorXd()); }),
            "derivatives of a solution: a direction has 3 variables and 0 rows, the program has 2 and 0");
  saddle.x = {0, NAN};
  EXPECT_EQ(SolutionSensitivities(nlp, saddle).status(), SensitivityStatus::kNotFinite);
  saddle.x = {0, 1};
  EXPECT_EQ(SolutionSensitivities(nlp, saddle).status(), SensitivityStatus::kNotASolution);
  saddle.x = {0};
  EXPECT_EQ(message_of<ArgumentError>([&] { SolutionSensitivities(nlp, saddle); }),
            "derivatives of a solution: x has 1 entries, the program has 2");
}

}  // namespace
}  // namespace dyntape::solution_sensitivities_test
