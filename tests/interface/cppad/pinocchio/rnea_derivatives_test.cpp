// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/pinocchio.h>
// Pinocchio's order
#include <pinocchio/algorithm/rnea-derivatives.hpp>

#include "robots.h"

namespace {

class PinocchioDerivatives : public PinocchioRecorded {};

// The algorithm that computes derivatives, recorded.
TEST_P(PinocchioDerivatives, OfInverseDynamics) {
  const Eigen::Index n = model_.nv;
  const CppAD::ADFun<double> f = record([&](const Vector& q, const Vector& v, const Vector& a) {
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
    Matrix dq = Matrix::Zero(n, n), dv = dq, da = dq;
    pin::computeRNEADerivatives(taped_, taped_data_, q, v, a, dq, dv, da);
    return Vector(dq * Vector(u_.cast<Scalar>()));
  });
  jacobian(f);
  MatrixXd dq = MatrixXd::Zero(n, n), dv = dq, da = dq;
  pin::computeRNEADerivatives(model_, data_, q_, v_, u_, dq, dv, da);
  expect_equal(value_, dq * u_, "dtau_dq u");
}

INSTANTIATE_TEST_SUITE_P(Robots, PinocchioDerivatives, ::testing::ValuesIn(kRobots),
                         [](const auto& robot) { return robot.param.name; });

}  // namespace
