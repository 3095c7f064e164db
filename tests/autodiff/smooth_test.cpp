// SPDX-License-Identifier: BSD-3-Clause
//
// Squares of norms, and smoothed norms and quotients, against their closed forms at points where a root has no slope.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/autodiff/record/smooth.h>

#include "dense.h"

namespace dyntape::testing::smooth_test {
namespace {

using Values = std::vector<double>;

std::string text(const Values& values) {
  std::ostringstream out;
  for (double v : values) out << " " << v;
  return out.str();
}

// Norms at a point where they have no slope themselves.
TEST(SquaredNorms, HaveTheirSlopeAndCurvatureAtZero) {
  using Squared = AD (*)(const VectorXad&);
  const Squared kSquares[] = {
      [](const VectorXad& x) { return x.norm() * x.norm(); },
      [](const VectorXad& x) { return pow(x.norm(), 2); },
      [](const VectorXad& x) { return pow(-x.norm(), 2.0); },
      [](const VectorXad& x) { return AD(2.0 * x.norm() * x.norm() / 2.0); },
      [](const VectorXad& x) { return x.squaredNorm(); },
      [](const VectorXad& x) { return AD(-(-x.norm() * x.norm())); },
      [](const VectorXad& x) { return hypot(x[0], x[1]) * hypot(x[0], x[1]); },
      [](const VectorXad& x) { return AD(abs(x[0]) * abs(x[0]) + pow(abs(x[1]), 2)); },
      [](const VectorXad& x) { return AD(pow(x.norm() / 3.0, 2) * 9.0); },
      [](const VectorXad& x) { return AD((x[0] + 3) * x.norm() * x.norm() / (x[0] + 3)); },
      [](const VectorXad& x) { return AD(pow(x.norm() / (x[0] + 3), 2) * pow(x[0] + 3, 2)); },
      [](const VectorXad& x) { return AD(2 * hypot(x[0], x[1]) * (hypot(x[0], x[1]) * 0.5)); },
      [](const VectorXad& x) {
        return AD((-3 * abs(x[0])) * abs(x[0]) / -3.0 + pow(0.5 * abs(x[1]), 2) * 4);
      },
  };
  for (std::size_t k = 0; k < std::size(kSquares); ++k) {
    const Function f =
        record("f", 2, [&](const VectorXad& x) { return VectorXad::Constant(1, kSquares[k](x)); });
    for (const Values& x : {Values{0, 0}, Values{0.3, -0.4}, Values{0, 2}}) {
      SCOPED_TRACE("square " + std::to_string(k) + " at" + text(x));
      EXPECT_NEAR(evaluate(f, x)[0], x[0] * x[0] + x[1] * x[1], 2e-15);
      const Eigen::MatrixXd j = jacobian(f, x), h = hessian(f, x, {1});
      EXPECT_NEAR(j(0, 0), 2 * x[0], 4e-15);
      EXPECT_NEAR(j(0, 1), 2 * x[1], 4e-15);
      EXPECT_LE((h - 2 * Eigen::Matrix2d::Identity()).cwiseAbs().maxCoeff(), 4e-15) << h;
    }
  }
}

// What may be negative keeps its root, and the NaN of it.
TEST(SquaredNorms, AreOfWhatCannotBeNegativeOnly) {
  const Function f = record("f", 2, [](const VectorXad& x) {
    return VectorXad{{AD(sqrt(x[0]) * sqrt(x[0])), pow(sqrt(x[0] * x[0] - x[1]), 2),
                      AD(sin(x[0]) * sin(x[0])), AD(sqrt(x[0] / x[1]) * sqrt(x[0] / x[1]))}};
  });
  const Function g = record("g", 1, [](const VectorXad& x) {
    return VectorXad{{AD(1e-200 * abs(x[0]) * abs(x[0])), pow(1e-200 * hypot(x[0], x[0]), 2)}};
  });
  const Values large = evaluate(g, {1e200});  // without overflow on the way
  EXPECT_NEAR(large[0] / 1e200, 1, 1e-15);
  EXPECT_NEAR(large[1], 2, 1e-15);
  const Values y = evaluate(f, {-1, 2});
  EXPECT_TRUE(std::isnan(y[0]) && std::isnan(y[1]) && std::isnan(y[3])) << text(y);
  EXPECT_EQ(y[2], own::sin(-1.0) * own::sin(-1.0));
}

// norm(v, s) = sqrt(v v + s s):  (v / r),  (I - v v^T / r^2) / r
TEST(Smoothed, NormsHaveTheirDerivatives) {
  const double s = 0.25;
  const Function f = record("f", 3, [&](const VectorXad& x) { return VectorXad::Constant(1, norm(x, s)); });
  for (const Values& x : {Values{0, 0, 0}, Values{0.3, -0.4, 1.2}, Values{1e-9, 0, 0}}) {
    const Eigen::Vector3d v(x[0], x[1], x[2]);
    const double r = std::sqrt(v.squaredNorm() + s * s);
    EXPECT_EQ(evaluate(f, x)[0], norm(v, s));
    EXPECT_NEAR(norm(v, s), r, 1e-15);
    EXPECT_LE((jacobian(f, x).transpose() - v / r).norm(), 1e-15) << text(x);
    const Eigen::Matrix3d h = (Eigen::Matrix3d::Identity() - v * v.transpose() / (r * r)) / r;
    EXPECT_LE((hessian(f, x, {1}) - h).norm(), 1e-14) << text(x);
  }
  EXPECT_THROW(norm(Eigen::Vector3d(1, 2, 3), 0.0), ArgumentError);
}

// safe_divide(a, b, s) = a g, g = b / d, d = b b + s s:  g' = (s s - b b) / d^2,  g'' = 2 b (b b - 3 s s) / d^3
TEST(Smoothed, QuotientsHaveTheirDerivatives) {
  const double s = 0.25;
  const Function f =
      record("f", 2, [&](const VectorXad& x) { return VectorXad::Constant(1, safe_divide(x[0], x[1], s)); });
  for (const Values& x : {Values{3, 0}, Values{0, 0}, Values{2, -0.5}, Values{-1, 4}}) {
    const double a = x[0], b = x[1], d = b * b + s * s, g = b / d, slope = (s * s - b * b) / (d * d),
                 curvature = 2 * b * (b * b - 3 * s * s) / (d * d * d);
    EXPECT_NEAR(evaluate(f, x)[0], a * g, 1e-14) << text(x);
    EXPECT_LE((jacobian(f, x) - Eigen::RowVector2d(g, a * slope)).norm(), 1e-13) << text(x);
    const Eigen::Matrix2d h{{0, slope}, {slope, a * curvature}};
    EXPECT_LE((hessian(f, x, {1}) - h).norm(), 1e-11) << text(x) << hessian(f, x, {1});
  }
  EXPECT_NEAR(safe_divide(1e200, 1e200, s), 1, 1e-15);  // no square overflows
  EXPECT_THROW(safe_divide(1.0, 2.0, -1), ArgumentError);
}

}  // namespace
}  // namespace dyntape::testing::smooth_test
