// SPDX-License-Identifier: BSD-3-Clause
#include "limits.h"

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape::python {

dynamics::Model<double> with_tied_limits(const Robot& robot) {
  RobotScene scene{robot.model()};
  scene.mimics = robot.urdf.mimics;
  const Ties ties = ties_of(scene);
  dynamics::Model<double>& model = scene.model;
  if (ties.empty()) return model;
  constexpr double kNone = dynamics::JointLimits::kNone;
  Eigen::VectorXd lower = Eigen::VectorXd::Constant(model.nq, -kNone), upper = -lower;
  Eigen::VectorXd fastest = Eigen::VectorXd::Constant(model.nv, kNone), slowest = -fastest;
  const auto for_each_single = [&](const auto& visit) {
    for (auto& joint : model.joints)
      if (dynamics::is_single(joint.type)) visit(joint.limits, joint.idx_q, joint.idx_v);
  };
  for_each_single([&](const auto& limits, int q, int v) {
    lower[q] = limits.lower, upper[q] = limits.upper;
    fastest[v] = limits.velocity, slowest[v] = -limits.velocity;
  });
  ties.narrow_q(lower, upper), ties.narrow_v(slowest, fastest);
  for_each_single([&](auto& limits, int q, int v) {
    limits.lower = lower[q], limits.upper = upper[q], limits.velocity = fastest[v];
  });
  for (const auto& joint : model.joints) {
    if (!dynamics::is_single(joint.type) || joint.limits.lower <= joint.limits.upper) continue;
    throw ArgumentError("robot \"" + model.name + "\": no position of joint '" + joint.name +
                        "' is within its limits and those of the joints that follow it: at least " +
                        io::significant(joint.limits.lower, 4) + " and at most " +
                        io::significant(joint.limits.upper, 4) +
                        "; expected other limits or another <mimic> in the robot's file");
  }
  return model;
}

}  // namespace dyntape::python
