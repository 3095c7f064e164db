// SPDX-License-Identifier: BSD-3-Clause
//
// Robots that stand: inverse kinematics of a floating robot with a given centre of mass and given feet, to add legs to a
// centroidal motion (centroidal_problem.h), and whether motors can hold a robot.
//
//   Posture pose = standing(scene, q, {com, {{"FL_FOOT", place}, {"FR_FOOT", place}, ...}});
//   if (pose.off > 1e-6) ...                 // out of reach: q is the nearest pose
//
// The trunk keeps its orientation in `q`.  Method: damped least squares, as in inverse_kinematics.h, over the
// trunk's position and all joints, without joint limits.  If there are several solutions, the result is one near
// `q`.
//
// Errors.  ArgumentError: a robot with a fixed base, unknown or fixed frames, targets that are not finite, a trunk
// without orientation.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/motion/robot_problem.h>

namespace dyntape {

struct Stand {
  Eigen::Vector3d com;                                        // m, world
  std::vector<std::pair<std::string, Eigen::Vector3d>> feet;  // frame, position of its origin (m, world)
};

struct Posture {
  Eigen::VectorXd q;
  double off = 0;  // m, the largest distance from a target
};

Posture standing(const RobotScene& scene, const Eigen::VectorXd& q, const Stand& stand);

// Searches a configuration with these feet over all joints within their limits: from `q`, then from random ones near it and
// anywhere within the limits.  For any robot.  The result is the nearest one found; its `off` does not prove that no
// other is nearer.
Posture reaching(const RobotScene& scene, const Eigen::VectorXd& q,
                 const std::vector<std::pair<std::string, Eigen::Vector3d>>& feet);

// A sentence on positions of feet that no configuration has (reaching()), in metres: "no configuration within the limits of
// the joints was found in which 'FL_FOOT' is at its foothold; the nearest misses it by 1.05 m"; "" if one was found.
// `what`: the noun, a "foothold" or a "target".  Takes milliseconds.
std::string missed_feet(const RobotScene& scene, const Eigen::VectorXd& q,
                        const std::vector<std::pair<std::string, Eigen::Vector3d>>& feet,
                        const std::string& what = "foothold");
// "the foothold of 'FL_FOOT' is 0.150 m below the floor, which is at z = 0 m"; "" if it is at most a millimetre below.
std::string below_floor(const std::string& frame, const Eigen::Vector3d& foothold, double floor,
                        const std::string& what = "foothold");

// The sum of the distances (m) between the origins of the joints from the root to a frame: no configuration stretches
// the limb further, but for prismatic joints.
double limb_length(const dynamics::Model<double>& model, const std::string& frame);

// A sentence, in N m or N, on motors that cannot hold the robot at rest in the state x of its problem, with the forces of its
// contacts within their cones; "" if they can, if x is not at rest, or if no motor would help.  Takes milliseconds.
std::string weak_motors(const RobotScene& scene, const RobotProblemOptions& options, const Problem& problem,
                        const Eigen::VectorXd& x);

// A sentence on the joint whose velocity limit allows the least part of its way from start to goal in the longest duration:
// "'elbow' has to move 2 rad in 0.05 s, and its velocity limit allows 0.25 rad"; "" if all limits allow the way.
std::string short_duration(const RobotScene& scene, const Problem& problem);

}  // namespace dyntape
