// SPDX-License-Identifier: BSD-3-Clause
//
// The steps of finite differences, joint type by joint type (robot_evaluator.h).
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/interface/robot/robot_evaluator.h>

namespace robot_differences_test {
namespace {

using namespace dyntape;
using dynamics::JointType;
using Eigen::VectorXd;

// Two joints: the one in question, far from zero, carries a revolute one.
dynamics::Model<double> robot_with(JointType type) {
  dynamics::Model<double> model;
  model.name = dynamics::to_string(type);
  model.gravity = {0, 0, -9.81};
  for (int i = 0; i < 2; ++i) {
    dynamics::Joint<double> joint;
    joint.name = "joint" + std::to_string(i);
    joint.type = i == 0 ? type : JointType::kRevolute;
    joint.axis = Eigen::Vector3d(0.6, 0, 0.8);
    joint.pitch = 0.2;
    dynamics::Placement<double> place;
    place.p = {0.1, 0.3, -0.2};
    model.add_joint(i - 1, joint, place,
                    {1.5, {0.1, -0.2, 0.3}, Eigen::Vector3d(0.4, 0.5, 0.6).asDiagonal()});
  }
  return model;
}

// d tau / d q of the first joint, by a step of size h.
VectorXd central(RobotEvaluator& rnea, const VectorXd& state, double h) {
  const auto moved = [&](double by) {
    VectorXd x = state;
    x[0] += by;
    return rnea(x);
  };
  return (moved(h) - moved(-h)) / (2 * h);
}

TEST(RobotDifferences, AJointOnALineIsMovedByAPartOfWhereItIs) {
  for (JointType type : {JointType::kRevolute, JointType::kPrismatic, JointType::kHelical}) {
    SCOPED_TRACE(dynamics::to_string(type));
    const auto model = robot_with(type);
    const double step = 0x1p-10;
    RobotEvaluatorOptions options;
    options.step = step;
    RobotEvaluator rnea(model, RobotFunction::kRnea, RobotRoute::kAnalytic);
    RobotEvaluator differences(model, RobotFunction::kIdDerivatives, RobotRoute::kFdCentral, options);
    for (double q : {0.5, 32.0, -64.0}) {
      const VectorXd state = (VectorXd(6) << q, 0.3, 1.2, -0.7, 0.4, 0.9).finished();
      const VectorXd expected = central(rnea, state, step * std::max(1.0, std::abs(q)));
      const VectorXd found = differences(state);
      EXPECT_NEAR(found[0], expected[0], 1e-11) << q;  // the first column of dtau_dq (2 x 2)
      EXPECT_NEAR(found[2], expected[1], 1e-11) << q;
      if (type == JointType::kPrismatic || std::abs(q) < 1) continue;  // linear: any step tells the same
      EXPECT_GT((central(rnea, state, step) - expected).norm(), 1e-6) << q;
    }
  }
}

}  // namespace

}  // namespace robot_differences_test
