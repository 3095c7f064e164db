// SPDX-License-Identifier: BSD-3-Clause
//
// Back-EMF of motors at constant voltage: the induced voltage reduces the current.
//
//   effects.back_emf = BackEmf<double>{kt, ke, resistance, gear_ratio};
//
//   tau = - N^2 k_t k_e / R v        k_t N m/A, k_e V s/rad, R ohm, N turns of the motor for one of the joint
// Energy: dissipated in R.  Linear; derivative - N^2 k_t k_e / R by v.  Source: M. Spong, S. Hutchinson, M.
// Vidyasagar, Robot Modeling and Control, actuator dynamics without inductance.
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>

namespace dyntape::dynamics {

template <class T>
struct BackEmf {
  static constexpr const char *kName = "back-EMF", *kKey = "back_emf";

  VectorX<T> torque_constant = {};   // (nv) k_t, N m/A; in all four only entries of single joints are used
  VectorX<T> voltage_constant = {};  // (nv) k_e, V s/rad
  VectorX<T> resistance = {};        // (nv) R, ohm
  VectorX<T> gear_ratio = {};        // (nv) N

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "torque_constant", .unit = "N m/A", .what = "torque per current", .least = 0},
          self.torque_constant);
    visit(ParameterInfo{.name = "voltage_constant",
                        .unit = "V s/rad",
                        .what = "voltage per speed of the motor",
                        .least = 0},
          self.voltage_constant);
    visit(ParameterInfo{.name = "resistance",
                        .unit = "ohm",
                        .what = "resistance of the windings",
                        .least = 0,
                        .above = true},
          self.resistance);
    visit(ParameterInfo{.name = "gear_ratio",
                        .unit = "1",
                        .what = "turns of the motor per turn of the joint",
                        .fallback = 1},
          self.gear_ratio);
  }
  T coefficient(int k) const {
    return gear_ratio[k] * gear_ratio[k] * torque_constant[k] * voltage_constant[k] / resistance[k];
  }
  void add_joint_torques(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>&,
                         const VectorRef<T>& v) const {
    for (const Joint<T>& joint : model.joints) {
      if (is_single(joint.type)) torques.tau[joint.idx_v] -= coefficient(joint.idx_v) * v[joint.idx_v];
    }
  }
  void add_joint_slopes(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>&,
                        const VectorRef<T>&) const {
    for (const Joint<T>& joint : model.joints) {
      if (is_single(joint.type)) torques.dtau_dv[joint.idx_v] -= coefficient(joint.idx_v);
    }
  }
};

}  // namespace dyntape::dynamics
