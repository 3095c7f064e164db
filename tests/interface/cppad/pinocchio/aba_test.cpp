// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/pinocchio.h>
// Pinocchio's order
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>

#include "robots.h"

namespace {

class PinocchioForwardDynamics : public PinocchioRecorded {};

TEST_P(PinocchioForwardDynamics, ForwardDynamics) {
  const Eigen::Index n = model_.nv;
  const MatrixXd J = jacobian(record([&](const Vector& q, const Vector& v, const Vector& tau) {
    return Vector(pin::aba(taped_, taped_data_, q, v, tau, pin::Convention::LOCAL));
  }));
  pin::computeABADerivatives(model_, data_, q_, v_, u_);
  MatrixXd Minv = data_.Minv;
  Minv.triangularView<Eigen::StrictlyLower>() = Minv.transpose().triangularView<Eigen::StrictlyLower>();
  expect_equal(value_, data_.ddq, "ddq");
  expect_equal(J.leftCols(n), data_.ddq_dq, "ddq_dq");
  expect_equal(J.middleCols(n, n), data_.ddq_dv, "ddq_dv");
  expect_equal(J.rightCols(n), Minv, "Minv");
}

INSTANTIATE_TEST_SUITE_P(Robots, PinocchioForwardDynamics, ::testing::ValuesIn(kRobots),
                         [](const auto& robot) { return robot.param.name; });

}  // namespace
