// SPDX-License-Identifier: BSD-3-Clause
//
// Viscous damping of joints: tau = - d v.
//
//   effects.damping = model_damping(model);   // the file's values
//
// Energy: dissipates, v . tau = - d v^2 <= 0.  Linear; derivative - d by v.
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>

namespace dyntape::dynamics {

template <class T>
struct Damping {
  static constexpr const char *kName = "joint damping", *kKey = "joint_damping";

  VectorX<T> coefficient;  // (nv) N m s/rad or N s/m

  Damping() = default;
  Damping(VectorX<T> values) : coefficient(std::move(values)) {}  // NOLINT
  template <class V>
  Damping(const Eigen::MatrixBase<V>& values) : coefficient(values) {}  // NOLINT

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "coefficient",
                        .unit = "N m s/rad or N s/m",
                        .what = "torque per velocity, against the motion",
                        .least = 0,
                        .fallback = 0,
                        .of_robot = model_damping<double>},
          self.coefficient);
  }
  void add_joint_torques(const Model<T>&, EffectTorques<T>& torques, const VectorRef<T>&,
                         const VectorRef<T>& v) const {
    torques.tau -= coefficient.cwiseProduct(v);
  }
  void add_joint_slopes(const Model<T>&, EffectTorques<T>& torques, const VectorRef<T>&,
                        const VectorRef<T>&) const {
    torques.dtau_dv -= coefficient;
  }
};

}  // namespace dyntape::dynamics
