// SPDX-License-Identifier: BSD-3-Clause
//
// Springs at joints: tau = - k (q - q_rest); angles of continuous joints in [-pi, pi].
//
//   effects.springs = Springs<double>{stiffness, rest};
//
// Energy: stores E = k (q - q_rest)^2 / 2 (J).  Linear, except for continuous joints half a turn from rest, where
// the torque jumps; derivative - k by q.
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/model/joints.h>

namespace dyntape::dynamics {

template <class T>
struct Springs {
  static constexpr const char *kName = "joint springs", *kKey = "joint_springs";

  VectorX<T> stiffness = {};  // (nv) N m/rad or N/m; for single joints, other entries are ignored
  VectorX<T> rest = {};       // (nq) configuration without spring torque

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(
        ParameterInfo{.name = "stiffness", .unit = "N m/rad or N/m", .what = "torque per angle", .least = 0},
        self.stiffness);
    visit(ParameterInfo{.name = "rest",
                        .unit = "rad or m",
                        .what = "position at which the spring is at rest",
                        .fallback = 0,
                        .length = Length::kConfiguration},
          self.rest);
  }
  // q - q_rest of a single joint.
  T deflection(const Joint<T>& joint, const VectorRef<T>& q) const {
    const int i = joint.idx_q;
    return traits(joint.type).on_a_line ? T(q[i] - rest[i]) : detail::angle_between<T>(rest, q, i);
  }
  void add_joint_torques(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>& q,
                         const VectorRef<T>&) const {
    for (const Joint<T>& joint : model.joints) {
      if (is_single(joint.type)) torques.tau[joint.idx_v] -= stiffness[joint.idx_v] * deflection(joint, q);
    }
  }
  void add_joint_slopes(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>&,
                        const VectorRef<T>&) const {
    for (const Joint<T>& joint : model.joints) {
      if (is_single(joint.type)) torques.dtau_dq[joint.idx_v] -= stiffness[joint.idx_v];
    }
  }
  T stored_energy(const Model<T>& model, const Data<T>&, const VectorRef<T>& q) const {
    T energy = T(0);
    for (const Joint<T>& joint : model.joints) {
      if (!is_single(joint.type)) continue;
      const T d = deflection(joint, q);
      energy += stiffness[joint.idx_v] * d * d * T(0.5);
    }
    return energy;
  }
};

}  // namespace dyntape::dynamics
