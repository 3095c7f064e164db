// SPDX-License-Identifier: BSD-3-Clause
//
// Coulomb friction of joints, smoothed so that it is differentiable at rest; with the Stribeck effect if both of its
// values are given.
//
//   effects.friction = CoulombFriction<double>{model_friction(model), 0.01};
//   effects.friction->breakaway = s, effects.friction->stribeck_speed = 0.05;
//
//   tau = - c tanh(v / w)                                      c sliding friction, N m or N
//   tau = - (c + (s - c) exp(-(v / v_s)^2)) tanh(v / w)        s breakaway friction
// Energy: dissipates for c, s >= 0.  Infinitely often differentiable; derivative by v, with t = tanh(v / w) and e =
// exp(-(v / v_s)^2):  - (c + (s - c) e) (1 - t^2) / w + 2 (s - c) e t v / v_s^2.  Source: B. Armstrong-Helouvry, P.
// Dupont, C. Canudas de Wit, A survey of models, analysis tools and compensation methods for the control of machines
// with friction, Automatica 30, 1994.
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>

namespace dyntape::dynamics {

template <class T>
struct CoulombFriction {
  static constexpr const char *kName = "joint friction", *kKey = "joint_friction";

  VectorX<T> torque = {};  // (nv) magnitude c of the sliding friction, N m or N
  T smoothing = T(0);      // speed w of the smoothing, rad/s or m/s: at w 76 % of the friction acts; > 0
  std::optional<VectorX<T>> breakaway = {};  // (nv) s, N m or N
  std::optional<T> stribeck_speed = {};      // v_s, rad/s or m/s; > 0

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "torque",
                        .unit = "N m or N",
                        .what = "friction torque while the joint moves",
                        .least = 0,
                        .fallback = 0,
                        .of_robot = model_friction<double>},
          self.torque);
    visit(ParameterInfo{.name = "smoothing",
                        .unit = "rad/s or m/s",
                        .what = "velocity at which friction nearly reaches its full torque",
                        .least = 0,
                        .above = true},
          self.smoothing);
    visit(ParameterInfo{.name = "breakaway",
                        .unit = "N m or N",
                        .what = "friction torque just before the joint moves; needs stribeck_speed",
                        .least = 0},
          self.breakaway);
    visit(ParameterInfo{.name = "stribeck_speed",
                        .unit = "rad/s or m/s",
                        .what = "velocity over which friction decreases from breakaway to torque",
                        .least = 0,
                        .above = true},
          self.stribeck_speed);
  }
  const char* missing() const {
    if (breakaway.has_value() == stribeck_speed.has_value()) return nullptr;
    return breakaway ? "stribeck_speed" : "breakaway";
  }
  bool falls() const { return breakaway && stribeck_speed; }
  // (s - c) exp(-(v / v_s)^2) of column k.
  T excess(int k, const T& v) const {
    const T ratio = v / *stribeck_speed;
    return ((*breakaway)[k] - torque[k]) * exp(-(ratio * ratio));
  }
  void add_joint_torques(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>&,
                         const VectorRef<T>& v) const {
    for (int k = 0; k < model.nv; ++k) {
      const T level = falls() ? T(torque[k] + excess(k, v[k])) : torque[k];
      torques.tau[k] -= level * tanh(v[k] / smoothing);
    }
  }
  void add_joint_slopes(const Model<T>& model, EffectTorques<T>& torques, const VectorRef<T>&,
                        const VectorRef<T>& v) const {
    for (int k = 0; k < model.nv; ++k) {
      const T t = tanh(v[k] / smoothing), rise = (T(1) - t * t) / smoothing;
      torques.dtau_dv[k] -= torque[k] * rise;
      if (!falls()) continue;
      const T fall = T(2) * t * (v[k] / *stribeck_speed) / *stribeck_speed;
      torques.dtau_dv[k] -= excess(k, v[k]) * (rise - fall);
    }
  }
};

}  // namespace dyntape::dynamics
