// SPDX-License-Identifier: BSD-3-Clause
//
// Coulomb friction of joints, smoothed so that it has a derivative at rest: tau = - c tanh(v / w).
//
//   effects.friction = CoulombFriction<double>{model_friction(model), 0.01};
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/model/checks.h>

namespace dyntape::dynamics {

template <class T>
struct CoulombFriction {
  static constexpr const char* kName = "joint friction";

  VectorX<T> torque;   // (nv) magnitude c of the sliding friction, N m or N
  T smoothing = T(0);  // speed w over which it builds up, rad/s or m/s: 76 % of it acts at this speed; > 0

  template <class S>
  CoulombFriction<S> cast() const {
    return {torque.template cast<S>(), static_cast<S>(smoothing)};
  }
  void check(const Model<T>& model) const {
    detail::check("effects", "friction", model, torque.size(), model.nv);
  }
  void add_joint_torques(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>&,
                         const VectorRef<T>& v) const {
    for (int k = 0; k < model.nv; ++k) torques.tau[k] -= torque[k] * tanh(v[k] / smoothing);
  }
  void add_joint_slopes(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>& v) const {
    for (int k = 0; k < model.nv; ++k) {
      const T t = tanh(v[k] / smoothing);
      torques.dtau_dv[k] -= torque[k] * ((T(1) - t * t) / smoothing);
    }
  }
};

}  // namespace dyntape::dynamics
