// SPDX-License-Identifier: BSD-3-Clause
//
// Rotations and directions as they were meant, not as they were typed.
//
//   SnappedRotation r = rotation_from_rpy({1.57079632679, 0, 0}, 1e-8);
//   r.R        // exactly [1 0 0; 0 0 -1; 0 1 0]
//   r.moved    // 4.9e-12: the angle that was corrected
//
// Files write right angles with few digits.  Read literally, 1.57079632679 leaves a cosine of 4.9e-12 in a
// matrix that should hold an exact zero: an entry that a recording must carry through every product.
// Angles within `tolerance` of a multiple of pi/2 take the exact sine and cosine of that multiple, so that a
// rotation made of right angles alone is a matrix of exact 0 and +-1.  Tolerance 0 reads literally.
//
// Convention (URDF): rotation about fixed x by roll, then fixed y by pitch, then fixed z by yaw,
//   R = Rz(yaw) Ry(pitch) Rx(roll),   v_parent = R v_child.  Angles in rad.
#pragma once

#include <Eigen/Core>

namespace dyntape::dynamics {

struct SnappedRotation {
  Eigen::Matrix3d R;
  double moved = 0;  // rad, largest correction that was made
  double near = 0;   // rad, largest distance of an angle that stayed but is within kNearRightAngle of one
};

struct SnappedAxis {
  Eigen::Vector3d axis;        // unit length
  double moved = 0, near = 0;  // as above
};

// An angle closer than this to pi/2, pi, ... is suspected to be a right angle with few digits.  Angles near
// zero are not suspected: small offsets are how calibrations are written.
inline constexpr double kNearRightAngle = 1e-3;

SnappedRotation rotation_from_rpy(const Eigen::Vector3d& rpy, double tolerance);

// Unit vector along `direction`, a coordinate axis where it is within `tolerance` (rad) of one.
// `direction` must not be zero.
SnappedAxis axis_from_direction(const Eigen::Vector3d& direction, double tolerance);

}  // namespace dyntape::dynamics
