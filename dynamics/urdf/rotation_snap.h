// SPDX-License-Identifier: BSD-3-Clause
//
// Rotations and directions from the rounded angles of a file, with right angles made exact.
//
//   SnappedRotation r = rotation_from_rpy({1.57079632679, 0, 0}, 1e-8);
//   r.R        // exactly [1 0 0; 0 0 -1; 0 1 0]
//   r.moved    // 4.9e-12: the angle that was corrected
//
// Files write right angles with few digits.  Without correction, 1.57079632679 gives a cosine of 4.9e-12 instead of
// an exact zero, and a recording carries this entry through every product.  An angle within `tolerance` of a
// multiple of pi/2 gets the exact sine and cosine of this multiple: a rotation by right angles is a matrix of exact
// 0 and +-1.  Tolerance 0: no correction.
//
// Convention (URDF): rotation about fixed x by roll, then fixed y by pitch, then fixed z by yaw,
//   R = Rz(yaw) Ry(pitch) Rx(roll),   v_parent = R v_child.  Angles in rad.
#pragma once

#include <Eigen/Core>

namespace dyntape::dynamics {

struct SnappedRotation {
  Eigen::Matrix3d R;
  double moved = 0;  // rad, largest correction
  double near =
      0;  // rad, largest distance of an uncorrected angle that is within kNearRightAngle of a right angle
};

struct SnappedAxis {
  Eigen::Vector3d axis;        // unit length
  double moved = 0, near = 0;  // as above
};

// An angle closer than this to pi/2, pi, ... is probably a right angle with few digits.  This does not apply to
// angles near zero: calibrations are small offsets.
inline constexpr double kNearRightAngle = 1e-3;

SnappedRotation rotation_from_rpy(const Eigen::Vector3d& rpy, double tolerance);

// The unit vector along `direction`; a coordinate axis if it is within `tolerance` (rad) of one.  `direction` must
// not be zero.
SnappedAxis axis_from_direction(const Eigen::Vector3d& direction, double tolerance);

}  // namespace dyntape::dynamics
