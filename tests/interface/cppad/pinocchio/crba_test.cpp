// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/pinocchio.h>
// Pinocchio's order
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>

#include "robots.h"

namespace {

class PinocchioMassMatrix : public PinocchioRecorded {};

TEST_P(PinocchioMassMatrix, MassMatrix) {
  const Eigen::Index n = model_.nv;
  const CppAD::ADFun<double> f = record([&](const Vector& q, const Vector&, const Vector&) {
    pin::crba(taped_, taped_data_, q, pin::Convention::LOCAL);
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> M = taped_data_.M;
    M.triangularView<Eigen::StrictlyLower>() = M.transpose().triangularView<Eigen::StrictlyLower>();
    return Vector(M * Vector(u_.cast<Scalar>()));
  });
  // d(M u)/dq: of inverse dynamics without velocity, less that of gravity.
  const MatrixXd J = jacobian(f);
  MatrixXd dq = MatrixXd::Zero(n, n), dv = dq, da = dq, gravity = dq;
  const VectorXd none = VectorXd::Zero(n);
  pin::computeRNEADerivatives(model_, data_, q_, none, u_, dq, dv, da);
  pin::computeGeneralizedGravityDerivatives(model_, data_, q_, gravity);
  expect_equal(J.leftCols(n), dq - gravity, "dMu_dq");
}

INSTANTIATE_TEST_SUITE_P(Robots, PinocchioMassMatrix, ::testing::ValuesIn(kRobots),
                         [](const auto& robot) { return robot.param.name; });

}  // namespace
