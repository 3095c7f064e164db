// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/rotation_snap.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dyntape::dynamics {
namespace {

struct SinCos {
  double s, c;
};

// Sine and cosine of one angle; what was done is noted in `moved` and `near`.
SinCos snapped_sin_cos(double angle, double tolerance, double& moved, double& near) {
  constexpr double kRight = std::numbers::pi / 2;
  const double turns = std::round(angle / kRight);
  const double distance = std::abs(angle - turns * kRight);
  const bool literal = tolerance <= 0 || distance > tolerance || std::abs(turns) > 1e6;
  if (literal) {
    if (turns != 0 && distance > tolerance && distance <= kNearRightAngle) near = std::max(near, distance);
    return {std::sin(angle), std::cos(angle)};
  }
  moved = std::max(moved, distance);
  constexpr double kSine[] = {0, 1, 0, -1};
  const int quarter = ((static_cast<int>(turns) % 4) + 4) % 4;
  return {kSine[quarter], kSine[(quarter + 1) % 4]};
}

// In gimbal lock (pitch = +-pi/2) only the sum or difference of roll and yaw matters, and neither need be
// a right angle for the rotation to be one.
void snap_whole_matrix(SnappedRotation& r, double tolerance) {
  const Eigen::Matrix3d exact = r.R.array().round();
  const double distance = (r.R - exact).cwiseAbs().maxCoeff();
  if (distance == 0 || distance > tolerance) return;
  if (!(exact * exact.transpose()).isIdentity(0)) return;
  r.R = exact;
  r.moved = std::max(r.moved, distance);
}

// The products below make -0 of 0 * -1; a plain zero prints and folds better.
void clear_signed_zeros(Eigen::Matrix3d& R) { R.array() += 0.0; }

}  // namespace

SnappedRotation rotation_from_rpy(const Eigen::Vector3d& rpy, double tolerance) {
  SnappedRotation r;
  const auto [sr, cr] = snapped_sin_cos(rpy.x(), tolerance, r.moved, r.near);
  const auto [sp, cp] = snapped_sin_cos(rpy.y(), tolerance, r.moved, r.near);
  const auto [sy, cy] = snapped_sin_cos(rpy.z(), tolerance, r.moved, r.near);
  r.R << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,     //
      -sp, cp * sr, cp * cr;
  if (tolerance > 0) snap_whole_matrix(r, tolerance);
  clear_signed_zeros(r.R);
  return r;
}

SnappedAxis axis_from_direction(const Eigen::Vector3d& direction, double tolerance) {
  // Scaled first, so that the norm neither overflows nor underflows.
  const Eigen::Vector3d scaled = direction / direction.cwiseAbs().maxCoeff();
  SnappedAxis result{scaled / scaled.norm()};
  Eigen::Index along = 0;
  scaled.cwiseAbs().maxCoeff(&along);
  Eigen::Vector3d exact = Eigen::Vector3d::Zero();
  exact[along] = std::copysign(1.0, scaled[along]);
  const double distance = (result.axis - exact).norm();
  if (distance == 0) {
    result.axis = exact;  // also turns -0 into 0
  } else if (tolerance > 0 && distance <= tolerance) {
    result.axis = exact;
    result.moved = distance;
  } else if (distance <= kNearRightAngle) {
    result.near = distance;
  }
  return result;
}

}  // namespace dyntape::dynamics
