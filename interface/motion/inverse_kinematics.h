// SPDX-License-Identifier: BSD-3-Clause
//
// A configuration in which a frame is where it shall be, within the limits of the joints.
//
//   const std::optional<Eigen::VectorXd> q = inverse_kinematics(scene, {"panda_hand", position, orientation}, start);
//   if (!q) ...                              // none was found, which is no proof that there is none
//
// Damped least squares: with r the error of the target (robot_terms.h) and J its derivatives, steps
//   dq = -J^T (J J^T + mu 1)^-1 r
// in which joints that a step would take beyond a limit stay there and the others make up for them.  A step is taken if the
// error falls, and mu with it; else mu grows (K. Levenberg, 1944; D. Marquardt, 1963; for manipulators C. Wampler, IEEE
// Transactions on Systems, Man, and Cybernetics 16(1), 1986).  Metres and radians count alike.
//
// The search begins at `from`, then at configurations drawn at random between the limits, the same ones every time; where a
// joint has no limits, within half a turn, or half a metre, of `from`.
//
// Errors: those of frame_error(); ArgumentError for a robot with joints of several degrees of freedom, and where `from` does
// not fit the robot.
#pragma once

#include <functional>
#include <optional>

#include <dyntape/interface/motion/robot_terms.h>

namespace dyntape {

struct InverseKinematicsOptions {
  int starts = 30;          // from which the search begins, the given one among them
  int iterations = 100;     // of each
  double tolerance = 1e-9;  // of the largest entry of the error (m, rad)
  std::function<bool(const Eigen::VectorXd& q)> accept =
      {};  // what else is asked of a result; empty: nothing
};

std::optional<Eigen::VectorXd> inverse_kinematics(const RobotScene& scene, const FrameTarget& target,
                                                  const Eigen::VectorXd& from,
                                                  const InverseKinematicsOptions& options = {});

// Within which sphere a frame stays, by lengths alone, of a robot with a fixed base: about the origin of the first joint that moves
// it.  Infinite where a joint that slides has no limits.
struct Reach {
  std::string joint;       // "": none moves the frame
  Eigen::Vector3d centre;  // m, world
  double radius;           // m
};
Reach reach_of(const dynamics::Model<double>& model, const std::string& frame);

// Why a position cannot be reached, in one sentence: "the goal is 611 m from 'pan', and 'tip' gets 0.731 m away from it at most; positions
// are in metres".  Empty: lengths do not forbid it.
std::string why_unreachable(const dynamics::Model<double>& model, const FrameTarget& target,
                            const std::string& what);

}  // namespace dyntape
