// SPDX-License-Identifier: BSD-3-Clause
//
// CondExp and what else code for OCS2 takes from CppAD, of recorded numbers and of doubles.
#include <cmath>
#include <limits>

#include "program.h"

namespace {

using ocs2::ad_scalar_t;
using ocs2::ad_vector_t;
using ocs2::vector_t;
using Order = ocs2::CppAdInterface::ApproximationOrder;

// As in code that is templated on its scalar.
template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> relations(const T& a, const T& b) {
  Eigen::Matrix<T, Eigen::Dynamic, 1> y(5);
  y << CppAD::CondExpLt(a, b, T(1), T(2)), CppAD::CondExpLe(a, b, T(1), T(2)),
      CppAD::CondExpEq(a, b, T(1), T(2)), CppAD::CondExpGe(a, b, T(1), T(2)),
      CppAD::CondExpGt(a, b, T(1), T(2));
  return y;
}

class Conditionals : public Program {};

TEST_F(Conditionals, FiveRelationsOfBothScalars) {
  const auto f = [](const ad_vector_t& x, ad_vector_t& y) { y = relations<ad_scalar_t>(x(0), x(1)); };
  ocs2::CppAdInterface model(f, 2, "relations", folder());
  model.createModels(Order::First, false);
  for (const auto& [a, b] : {std::pair(1.0, 2.0), std::pair(2.0, 2.0), std::pair(3.0, 2.0)})
    expect_near(model.getFunctionValue(Eigen::Vector2d(a, b)), relations<double>(a, b), 0);
  expect_near(relations<double>(2, 2), (vector_t(5) << 2, 1, 1, 1, 2).finished(), 0);
}

TEST_F(Conditionals, OperandsOfBothKinds) {
  const auto f = [](const ad_vector_t& x, ad_vector_t& y) {
    y.resize(3);
    y << CondExpLt(x(0), 0.0, -x(0), x(0)), CondExpGt(x(0), ad_scalar_t(1), 7.0, x(0)),
        ocs2::CondExpGe(0.0, x(0), 1.0, 2.0);
  };
  ocs2::CppAdInterface model(f, 1, "kinds", folder());
  model.createModels(Order::First, false);
  expect_near(model.getFunctionValue(vector_t::Constant(1, -3)), Eigen::Vector3d(3, -3, 1), 0);
  expect_near(model.getFunctionValue(vector_t::Constant(1, 3)), Eigen::Vector3d(3, 7, 2), 0);
  expect_near(model.getJacobian(vector_t::Constant(1, -3)), Eigen::Vector3d(-1, 1, 0), 0);
}

// There the value is right and the slope is not a number.
TEST_F(Conditionals, AGuardedSingularityHasASlope) {
  const auto f = [](const ad_vector_t& x, ad_vector_t& y) {
    const ad_scalar_t n2 = x.squaredNorm(), n = sqrt(n2);
    y = ad_vector_t::Constant(
        1, CppAD::CondExpGt(n2, ad_scalar_t(1e-12), CppAD::sin(n) / n, ad_scalar_t(1) - n2 / 6.0));
  };
  ocs2::CppAdInterface model(f, 3, "sinc", folder());
  model.createModels(Order::Second, false);
  const vector_t zero = vector_t::Zero(3);
  EXPECT_EQ(model.getFunctionValue(zero)[0], 1);
  expect_near(model.getJacobian(zero), ocs2::matrix_t::Zero(1, 3), 0);
  expect_near(model.getHessian(0, zero), -ocs2::matrix_t::Identity(3, 3) / 3, 1e-15);
}

TEST_F(Conditionals, TheirOtherFreeFunctions) {
  EXPECT_EQ(CppAD::sign(-2.0), -1);
  EXPECT_EQ(CppAD::sign(ad_scalar_t(0)).value(), 0);
  EXPECT_TRUE(CppAD::isnan(CppAD::numeric_limits<double>::quiet_NaN()));
  EXPECT_EQ(CppAD::numeric_limits<ad_scalar_t>::epsilon().value(), std::numeric_limits<double>::epsilon());
  const auto f = [](const ad_vector_t& x, ad_vector_t& y) {
    EXPECT_TRUE(CppAD::Variable(x(0)));
    EXPECT_TRUE(CppAD::Parameter(CppAD::Var2Par(x(0))));
    y = ad_vector_t::Constant(1, CppAD::pow(x(0), 2) + CppAD::atan2(x(0), ad_scalar_t(1)) *
                                                           CppAD::Value(CppAD::Var2Par(x(0))) * 0.0);
  };
  ocs2::CppAdInterface model(f, 1, "free", folder());
  model.createModels(Order::First, false);
  EXPECT_EQ(model.getFunctionValue(vector_t::Constant(1, 3))[0], 9);
}

}  // namespace
