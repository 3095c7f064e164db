// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/pinocchio.h>
// Pinocchio's order
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "robots.h"

namespace {

class PinocchioInverseDynamics : public PinocchioRecorded {};

TEST_P(PinocchioInverseDynamics, InverseDynamics) {
  const Eigen::Index n = model_.nv;
  const MatrixXd J = jacobian(record([&](const Vector& q, const Vector& v, const Vector& a) {
    return Vector(pin::rnea(taped_, taped_data_, q, v, a));
  }));
  MatrixXd dq = MatrixXd::Zero(n, n), dv = dq, da = dq;
  pin::computeRNEADerivatives(model_, data_, q_, v_, u_, dq, dv, da);
  da.triangularView<Eigen::StrictlyLower>() = da.transpose().triangularView<Eigen::StrictlyLower>();
  expect_equal(value_, data_.tau, "tau");
  expect_equal(J.leftCols(n), dq, "dtau_dq");
  expect_equal(J.middleCols(n, n), dv, "dtau_dv");
  expect_equal(J.rightCols(n), da, "dtau_da");
}

INSTANTIATE_TEST_SUITE_P(Robots, PinocchioInverseDynamics, ::testing::ValuesIn(kRobots),
                         [](const auto& robot) { return robot.param.name; });

}  // namespace
