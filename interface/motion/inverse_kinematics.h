// SPDX-License-Identifier: BSD-3-Clause
//
// Inverse kinematics: finds a configuration at which a frame has a given pose, within the limits of the joints.
//
//   const std::optional<Eigen::VectorXd> q = inverse_kinematics(scene, {"panda_hand", position, orientation}, start);
//   if (!q) ...                              // none found; this does not prove that none exists
//
// Method.  Damped least squares: with r the error of the target (robot_terms.h) and J its Jacobian, steps
//   dq = -J^T (J J^T + mu 1)^-1 r
// A joint that a step would move beyond its limit stays at the limit, and the other joints compensate.  If the error
// falls, the step is accepted and mu is reduced; else mu grows.  One metre and one radian have equal weight.
//
// The search starts at `from`, then at random configurations within the limits, the same in every call.  For joints
// without limits the random range is half a turn, or half a metre, around `from`.
//
// Errors.  Those of frame_error().  ArgumentError: a joint of several degrees of freedom, a `from` that does not fit
// the robot.
//
// Sources: K. Levenberg, 1944; D. Marquardt, 1963; C. Wampler, IEEE Transactions on Systems, Man, and Cybernetics
// 16(1), 1986 (manipulators).
#pragma once

#include <functional>
#include <optional>

#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

struct InverseKinematicsOptions {
  int starts = 30;          // number of start configurations, including `from`
  int iterations = 100;     // most iterations per start
  double tolerance = 1e-9;  // for the largest entry of the error (m, rad)
  std::function<bool(const Eigen::VectorXd& q)> accept = {};  // an extra condition on the result; empty: none
};

std::optional<Eigen::VectorXd> inverse_kinematics(const RobotScene& scene, const FrameTarget& target,
                                                  const Eigen::VectorXd& from,
                                                  const InverseKinematicsOptions& options = {});

// A sphere that contains all positions of a frame, from the lengths of the links alone; for robots with a fixed
// base.  The centre is the origin of the first joint that moves the frame.  Infinite if a prismatic joint has no
// limits.
struct Reach {
  std::string joint;       // "": no joint moves the frame
  Eigen::Vector3d centre;  // m, world
  double radius;           // m
};
Reach reach_of(const dynamics::Model<double>& model, const std::string& frame);

// Returns why a position is out of reach: "the goal is 611 m from 'pan', and 'tip' gets 0.731 m away from it at
// most; positions are in metres".  Returns "" if the lengths of the links allow it.
std::string why_unreachable(const dynamics::Model<double>& model, const FrameTarget& target,
                            const std::string& what);

}  // namespace dyntape
