// SPDX-License-Identifier: BSD-3-Clause
//
// The robot of pinocchio_peer.h as Pinocchio's: headers only, built joint by joint (linking the URDF parser of the
// wheel under -march=native crashes).
#pragma once

#include <pinocchio/multibody.hpp>
#include <pinocchio/multibody/joint.hpp>

#include <string>

#include "pinocchio_peer.h"

namespace peer {

namespace pin = pinocchio;

// A type of its own for each coordinate axis, as Pinocchio's reader of files chooses.
template <class X, class Y, class Z, class General>
pin::JointModel along(const Eigen::Vector3d& axis) {
  if (axis == Eigen::Vector3d::UnitX()) return X();
  if (axis == Eigen::Vector3d::UnitY()) return Y();
  if (axis == Eigen::Vector3d::UnitZ()) return Z();
  return General(axis);
}

inline bool joint_model(const dyntape_peer_joint& joint, pin::JointModel& model) {
  const std::string type = joint.type;
  const Eigen::Vector3d axis(joint.axis[0], joint.axis[1], joint.axis[2]);
  if (type == "revolute") {
    model = along<pin::JointModelRX, pin::JointModelRY, pin::JointModelRZ, pin::JointModelRevoluteUnaligned>(
        axis);
  } else if (type == "continuous") {
    model = along<pin::JointModelRUBX, pin::JointModelRUBY, pin::JointModelRUBZ,
                  pin::JointModelRevoluteUnboundedUnaligned>(axis);
  } else if (type == "prismatic") {
    model = along<pin::JointModelPX, pin::JointModelPY, pin::JointModelPZ, pin::JointModelPrismaticUnaligned>(
        axis);
  } else if (type == "helical") {
    model = pin::JointModelHelicalUnaligned(axis, joint.pitch);
  } else if (type == "free-flyer") {
    model = pin::JointModelFreeFlyer();
  } else if (type == "spherical") {
    model = pin::JointModelSpherical();
  } else if (type == "planar") {
    model = pin::JointModelPlanar();
  } else {
    return false;
  }
  return true;
}

inline pin::SE3 placement_of(const double* rotation, const double* translation) {
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return {Eigen::Map<const RowMajor>(rotation), Eigen::Map<const Eigen::Vector3d>(translation)};
}

// False where a joint is of a type that Pinocchio does not have.
inline bool build_model(const dyntape_peer_joint* joints, int count, const double* gravity,
                        pin::Model& model) {
  for (int i = 0; i < count; ++i) {
    const dyntape_peer_joint& joint = joints[i];
    pin::JointModel kind;
    if (!joint_model(joint, kind)) return false;
    const auto index =
        model.addJoint(static_cast<pin::JointIndex>(joint.parent + 1), kind,
                       placement_of(joint.rotation, joint.translation), "joint" + std::to_string(i));
    const double* s = joint.inertia;
    const pin::Symmetric3 inertia(s[0], s[1], s[2], s[3], s[4], s[5]);
    model.appendBodyToJoint(index,
                            pin::Inertia(joint.mass, Eigen::Map<const Eigen::Vector3d>(joint.com), inertia),
                            pin::SE3::Identity());
    model.armature.segment(model.joints[index].idx_v(), model.joints[index].nv()).setConstant(joint.armature);
  }
  model.gravity.linear() = Eigen::Map<const Eigen::Vector3d>(gravity);
  return true;
}

}  // namespace peer
