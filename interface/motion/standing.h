// SPDX-License-Identifier: BSD-3-Clause
//
// A configuration of a floating robot whose centre of mass and feet are where they shall be: the legs to a motion of one mass
// (centroidal_problem.h).
//
//   Posture pose = standing(scene, q, {com, {{"FL_FOOT", place}, {"FR_FOOT", place}, ...}});
//   if (pose.off > 1e-6) ...                 // out of the legs' reach: q comes as near as it can
//
// The trunk keeps the orientation that it has in `q`.  Damped least squares, as in inverse_kinematics.h, over the trunk's
// position and all joints, without limits of joints: of several configurations one near `q`.
//
// Errors: ArgumentError for a robot with a fixed base, unknown or fixed frames, targets that are no numbers, a trunk
// without orientation.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

struct Stand {
  Eigen::Vector3d com;                                        // m, world
  std::vector<std::pair<std::string, Eigen::Vector3d>> feet;  // frame, place of its origin (m, world)
};

struct Posture {
  Eigen::VectorXd q;
  double off = 0;  // m, what is farthest from its place
};

Posture standing(const RobotScene& scene, const Eigen::VectorXd& q, const Stand& stand);

}  // namespace dyntape
