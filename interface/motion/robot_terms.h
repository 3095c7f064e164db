// SPDX-License-Identifier: BSD-3-Clause
//
// Positions, orientations and velocities of a robot's frames as functions for terms: goals, costs and constraints.
//
//   const RobotScene scene{load_urdf("panda.urdf"), {}, {}};
//   Problem p = robot_problem(scene, {.duration = 2});
//   const FrameTarget grasp{"panda_hand", Eigen::Vector3d(0.5, 0.2, 0.4), rotation_of(M_PI, 0, 0)};
//   p.add(terminal_equality("grasp", frame_error(scene, grasp)));                  // the hand ends there
//   p.add(running_squares("near", weighted(frame_error(scene, grasp), 10)));       // cost of the distance on the way
//   p.add(path_equality("level", frame_orientation(scene, "panda_hand", R)));      // or no tilt at any time
//
// Each can be a cost, an equality or an inequality, along the path or at the end.  capsules.h has collision
// avoidance.
//
// The state of the problem must begin with (q, v), as in robot_problem().  World frame; units m, rad, s.  Positions
// are polynomials of sines and cosines of the joints; functions that are less smooth say so.
//
// Errors.  ArgumentError: a frame that is unknown (with the nearest name) or fixed to the world, a target that is
// not finite or not a rotation, an axis of length zero, a negative weight, a target without position and
// orientation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// The target of a frame: its origin, its orientation, or both.
struct FrameTarget {
  std::string frame;
  std::optional<Eigen::Vector3d> position = {};     // m, world
  std::optional<Eigen::Matrix3d> orientation = {};  // rotation from the frame's axes to the world's
};

// Rz(yaw) Ry(pitch) Rx(roll): angles as URDF files have them (rad).
Eigen::Matrix3d rotation_of(double roll, double pitch, double yaw);

// (3) p - target (m).
StageFunction frame_position(const RobotScene& scene, const std::string& frame,
                             const Eigen::Vector3d& target);

// (3) log(target^T R): the rotation vector from the target to the frame, in the target's axes (rad, up to pi).  Zero
// and smooth at the target, smooth up to half a turn, where the axis changes sign.
StageFunction frame_orientation(const RobotScene& scene, const std::string& frame,
                                const Eigen::Matrix3d& target);

// The same with a moving target: (9) the rotation matrix row by row, usually a parameter.
StageFunction moving_frame_orientation(const RobotScene& scene, const std::string& frame,
                                       const StageFunction& target);

// (3) or (6) The errors that the target defines: position, then orientation.
StageFunction frame_error(const RobotScene& scene, const FrameTarget& target);

// (6) Linear (m/s), then angular velocity (rad/s); `in` selects point and axes (algorithms.h).
StageFunction frame_velocity(const RobotScene& scene, const std::string& frame, dynamics::ReferenceFrame in);

// (2) The error of an axis of the frame that points at a place in the world: tan(angle / 2) along two directions
// across the axis.  Any nonzero length.  Zero only if the axis points at the place.  Singular if the place is at the
// frame's origin, or exactly behind it.
StageFunction frame_looks_at(const RobotScene& scene, const std::string& frame, const Eigen::Vector3d& axis,
                             const Eigen::Vector3d& place);

// (3) Centre of mass - target (m).
StageFunction com_position(const RobotScene& scene, const Eigen::Vector3d& target);

// (6) Momentum of the whole robot - target: linear (kg m/s), then angular about the centre of mass (kg m^2/s), world
// axes.
StageFunction centroidal_momentum(
    const RobotScene& scene, const Eigen::Matrix<double, 6, 1>& target = Eigen::Matrix<double, 6, 1>::Zero());

// Residuals for a cost with this weight: sqrt(weight) r.
StageFunction weighted(const StageFunction& residuals, double weight);
// Entries first, ..., first + count - 1: part_of(frame_velocity(...), 0, 3) is the linear velocity.
StageFunction part_of(const StageFunction& values, int first, int count);
// These entries, in this order.
StageFunction entries_of(const StageFunction& values, const std::vector<int>& entries);

// Index of a frame that a joint moves; else ArgumentError.
int moving_frame(const dynamics::Model<double>& model, const std::string& frame);

// World axes along which (0, 1, 2) and about which (3, 4, 5) the robot can move a frame: 0, 2 and 4 for a robot in
// the x-z plane.  Rows for the other axes are zero, and forces along them have no effect.
std::vector<int> moved_axes(const dynamics::Model<double>& model, const std::string& frame);

}  // namespace dyntape
