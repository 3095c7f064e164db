// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/pinocchio.h>
// Pinocchio's order
#include <pinocchio/algorithm/centroidal.hpp>

#include "robots.h"

namespace {

class PinocchioCentroidalMomentum : public PinocchioRecorded {};

TEST_P(PinocchioCentroidalMomentum, CentroidalMomentum) {
  const Eigen::Index n = model_.nv;
  const MatrixXd J = jacobian(record([&](const Vector& q, const Vector& v, const Vector&) {
    return Vector(pin::computeCentroidalMomentum(taped_, taped_data_, q, v).toVector());
  }));
  pin::computeCentroidalMap(model_, data_, q_);
  expect_equal(J.middleCols(n, n), data_.Ag, "Ag");
}

INSTANTIATE_TEST_SUITE_P(Robots, PinocchioCentroidalMomentum, ::testing::ValuesIn(kRobots),
                         [](const auto& robot) { return robot.param.name; });

}  // namespace
