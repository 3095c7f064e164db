// SPDX-License-Identifier: BSD-3-Clause
//
// Quaternions and pairs (cos, sin) of any length but zero: only their direction is read.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::lengths_test {
namespace {

// Scaled by powers of two, so that a right result has the same bits, up to where squares of the length leave the range of
// the scalar: q with lengths `factor`.
template <class T>
VectorX<T> with_lengths(const Model<double>& model, Eigen::VectorXd q, double factor) {
  for (const Joint<double>& joint : model.joints) unit_part(joint, q) *= factor;
  return q.cast<T>();
}

template <class T>
void expect_that_length_carries_nothing(const std::vector<int>& exponents) {
  for (unsigned long seed = 1; seed <= 4; ++seed) {
    Random random(seed);
    const Model<T> model = random_tree(random, {.joints = 14, .base = Base::kFloating}).cast<T>();
    const Model<double> plain = model.template cast<double>();
    const State s = random_state(plain, random);
    const VectorX<T> q = s.q.cast<T>(), v = s.v.cast<T>(), a = s.a.cast<T>(),
                     q_other = random_configuration<double>(plain, random.engine).cast<T>();
    Data<T> data(model);
    const VectorX<T> tau = rnea<T>(model, data, q, v, a), next = integrate<T>(model, q, v),
                     there = difference<T>(model, q, q_other), back = difference<T>(model, q_other, q);
    for (const int exponent : exponents) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", lengths 2^" + std::to_string(exponent));
      const VectorX<T> scaled = with_lengths<T>(plain, s.q, std::ldexp(1.0, exponent));
      EXPECT_EQ(rnea<T>(model, data, scaled, v, a), tau);
      EXPECT_EQ(integrate<T>(model, scaled, v), next);
      EXPECT_EQ(difference<T>(model, scaled, q_other), there);
      EXPECT_EQ(difference<T>(model, q_other, scaled), back);
      EXPECT_LE(difference<T>(model, q, scaled).cwiseAbs().maxCoeff(), T(1e-6));
      EXPECT_LE(difference<T>(model, scaled, scaled).cwiseAbs().maxCoeff(), T(1e-6));
    }
  }
}

TEST(Lengths, CarryNothingInTheWholeRange) {
  expect_that_length_carries_nothing<double>(
      {-1000, -530, -510, -385, -384, -300, -1, 1, 200, 383, 384, 385, 511, 512, 513, 700, 1000, 1022});
  expect_that_length_carries_nothing<float>(
      {-110, -64, -63, -49, -48, -10, 10, 47, 48, 49, 63, 64, 100, 126});
}

TEST(Lengths, OfTheSmallestAndTheLargestNumbers) {
  for (const double x : {5e-324, 1e-310, 1e-200, 1e160, 1.7e308}) {
    const Matrix3<double> R = rotation(Eigen::Vector4d(x, x, x, x)), expected(0, 0, 1, 1, 0, 0, 0, 1, 0);
    EXPECT_LE((R - expected).cwiseAbs().maxCoeff(), 1e-15) << x;
    EXPECT_LE((normalized(Eigen::Vector4d(0, x, 0, x)) - Eigen::Vector4d(0, std::sqrt(.5), 0, std::sqrt(.5)))
                  .norm(),
              1e-15);
    EXPECT_LE((log(Eigen::Vector4d(x, 0, 0, x)) - Vector3<double>(std::acos(0.0), 0, 0)).norm(), 1e-15) << x;
    const auto [c, s] = detail::direction(-x, x);
    EXPECT_NEAR(c, -std::sqrt(.5), 1e-15) << x;
    EXPECT_NEAR(s, std::sqrt(.5), 1e-15) << x;
  }
}

// A length of zero, or one that is no number, has no direction: no number comes out that looks like one.
TEST(Lengths, WithoutADirectionAreNotANumber) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const double x : {0.0, inf, nan}) {
    EXPECT_FALSE(rotation(Eigen::Vector4d(x, 0, 0, 0)).allFinite()) << x;
    EXPECT_FALSE(normalized(Eigen::Vector4d(0, 0, 0, x)).allFinite()) << x;
    EXPECT_TRUE(std::isnan(detail::direction(x, 0.0).first)) << x;
  }
}

}  // namespace
}  // namespace dyntape::dynamics::lengths_test
