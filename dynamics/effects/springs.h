// SPDX-License-Identifier: BSD-3-Clause
//
// Springs at joints: tau = - k (q - q_rest); angles of continuous joints in [-pi, pi].
//
//   effects.springs = Springs<double>{stiffness, rest};
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/model/checks.h>

namespace dyntape::dynamics {

template <class T>
struct Springs {
  static constexpr const char* kName = "joint springs";

  VectorX<T> stiffness;  // (nv) N m/rad or N/m; of single joints, other entries are not read
  VectorX<T> rest;       // (nq) configuration without spring torque

  template <class S>
  Springs<S> cast() const {
    return {stiffness.template cast<S>(), rest.template cast<S>()};
  }
  void check(const Model<T>& model) const {
    detail::check("effects", "spring stiffness", model, stiffness.size(), model.nv);
    detail::check("effects", "spring rest", model, rest.size(), model.nq);
  }
  void add_joint_torques(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>& q,
                         const VectorRef<T>&) const {
    for (const Joint<T>& joint : model.joints) {
      if (!is_single(joint.type)) continue;
      difference<T>(joint, rest, q, torques.deflection);
      torques.tau[joint.idx_v] -= stiffness[joint.idx_v] * torques.deflection[joint.idx_v];
    }
  }
  void add_joint_slopes(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>&) const {
    for (const Joint<T>& joint : model.joints) {
      if (is_single(joint.type)) torques.dtau_dq[joint.idx_v] -= stiffness[joint.idx_v];
    }
  }
};

}  // namespace dyntape::dynamics
