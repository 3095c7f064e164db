// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/model.h>
#include <algorithm>
#include <cmath>

namespace dyntape::dynamics::detail {
int place_of(const std::string& wanted, const std::vector<std::string>& names) {
  const auto found = std::find(names.begin(), names.end(), wanted);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

void refuse_name(const std::string& what, const std::string& model_name, const std::string& wanted,
                 const std::string& meant) {
  throw ArgumentError("model \"" + model_name + "\" has no " + what + " \"" + wanted + "\"" + meant);
}

void check_new_joint(const std::string& name, JointType type, const Eigen::Vector3d& axis, double pitch,
                     int parent, int njoints) {
  if (parent < -1 || parent >= njoints) {
    throw ArgumentError("add_joint: joint \"" + name + "\" names parent " + std::to_string(parent) +
                        ", expected -1 (the world) to " + std::to_string(njoints - 1));
  }
  const double length = axis.norm();
  if (is_single(type) && !(std::abs(length - 1) <= 1e-12)) {
    throw ArgumentError("add_joint: the axis of joint \"" + name + "\" has length " + std::to_string(length) +
                        ", expected 1");
  }
  if (type == JointType::kHelical && !std::isfinite(pitch)) {
    throw ArgumentError("add_joint: the pitch of joint \"" + name + "\" is " + std::to_string(pitch) +
                        ", expected a finite number of metres per radian");
  }
}

void check_universal(const std::string& name, const Eigen::Vector3d& axis_1, const Eigen::Vector3d& axis_2) {
  if (axis_1.stableNormalized().cross(axis_2.stableNormalized()).norm() > 1e-6) return;
  throw ArgumentError("add_universal: the axes of joint \"" + name +
                      "\" are parallel, so that it has one degree of freedom; expected two directions");
}

}  // namespace dyntape::dynamics::detail
