// SPDX-License-Identifier: BSD-3-Clause
//
// Where a robot's frames are and how they move, ready to be made terms of a problem.
//
//   const RobotScene scene{load_urdf("panda.urdf"), {}, {}};
//   Problem p = robot_problem(scene, {.duration = 2});
//   const FrameTarget grasp{"panda_hand", Eigen::Vector3d(0.5, 0.2, 0.4), rotation_of(M_PI, 0, 0)};
//   p.add(terminal_equality("grasp", frame_error(scene, grasp)));                  // the hand ends there,
//   p.add(running_squares("near", weighted(frame_error(scene, grasp), 10)));       // is drawn there on the way,
//   p.add(path_equality("level", frame_orientation(scene, "panda_hand", R)));      // or is never tilted
//
// Any of them serves as cost, equality or inequality, along the path or at the end; bodies that keep clear of each
// other are in capsules.h.
//
// The state of the problem begins with (q, v), as that of robot_problem() does.  World frame, m, rad, s.  Positions are
// polynomials of sines and cosines of the joints; what is less smooth says so.
//
// Errors: ArgumentError for a frame that is unknown (with the nearest name) or fixed to the world, for targets that are
// no numbers or no rotation, for an axis of length zero, a weight below zero, a target without position and orientation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// Where a frame shall be: its origin, its axes, or both.
struct FrameTarget {
  std::string frame;
  std::optional<Eigen::Vector3d> position = {};     // m, world
  std::optional<Eigen::Matrix3d> orientation = {};  // from the frame's axes to the world's
};

// Rz(yaw) Ry(pitch) Rx(roll): angles as URDF files have them (rad).
Eigen::Matrix3d rotation_of(double roll, double pitch, double yaw);

// (3) p - target (m).
StageFunction frame_position(const RobotScene& scene, const std::string& frame,
                             const Eigen::Vector3d& target);

// (3) log(target^T R): the axis, seen in the target's axes, about which the frame is turned away from the target, as long as
// the angle (rad, up to pi).  Zero and smooth at the target, smooth up to half a turn, where the axis changes sides.
StageFunction frame_orientation(const RobotScene& scene, const std::string& frame,
                                const Eigen::Matrix3d& target);

// The same of a target that moves: (9) the rotation row by row, of a parameter for one.
StageFunction moving_frame_orientation(const RobotScene& scene, const std::string& frame,
                                       const StageFunction& target);

// (3) or (6) What the target gives of these: position, then orientation.
StageFunction frame_error(const RobotScene& scene, const FrameTarget& target);

// (6) Linear (m/s), then angular velocity (rad/s), of the point and in the axes that `in` says (algorithms.h).
StageFunction frame_velocity(const RobotScene& scene, const std::string& frame, dynamics::ReferenceFrame in);

// (2) How far an axis of the frame, of any length, points past a place in the world: tan(angle / 2) along two directions
// across the axis.  Zero only where it points there.  Singular where the place is at the frame's origin, or lies exactly
// behind it.
StageFunction frame_looks_at(const RobotScene& scene, const std::string& frame, const Eigen::Vector3d& axis,
                             const Eigen::Vector3d& place);

// (3) Centre of mass - target (m).
StageFunction com_position(const RobotScene& scene, const Eigen::Vector3d& target);

// (6) Momentum of the whole robot - target: linear (kg m/s), then angular about the centre of mass (kg m^2/s), world axes.
StageFunction centroidal_momentum(
    const RobotScene& scene, const Eigen::Matrix<double, 6, 1>& target = Eigen::Matrix<double, 6, 1>::Zero());

// Residuals whose squares count `weight` times: sqrt(weight) r.
StageFunction weighted(const StageFunction& residuals, double weight);
// Entries first, ..., first + count - 1: part_of(frame_velocity(...), 0, 3) is the linear one.
StageFunction part_of(const StageFunction& values, int first, int count);
// These entries, in this order.
StageFunction entries_of(const StageFunction& values, const std::vector<int>& entries);

// Index of a frame that a joint moves; ArgumentError otherwise.
int moving_frame(const dynamics::Model<double>& model, const std::string& frame);

// World axes along which (0, 1, 2) and about which (3, 4, 5) the robot can move a frame: 0, 2 and 4 of a robot in the plane of x
// and z.  Rows of the others say nothing, and forces along them do nothing.
std::vector<int> moved_axes(const dynamics::Model<double>& model, const std::string& frame);

}  // namespace dyntape
