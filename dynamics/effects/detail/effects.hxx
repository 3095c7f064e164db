// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>
#include <dyntape/dynamics/effects/detail/added_torques.hxx>

namespace dyntape::dynamics {
namespace detail {

template <class T, class Field>
VectorX<T> joint_values(const Model<T>& model, Field field) {
  VectorX<T> values = VectorX<T>::Zero(model.nv);
  for (const Joint<T>& joint : model.joints) {
    if (is_single(joint.type)) values[joint.idx_v] = joint.*field;
  }
  return values;
}

template <class T>
void check_effects(const Model<T>& model, const Effects<T>& effects) {
  const char* who = "effects";
  if (effects.armature) check(who, "armature", model, effects.armature->size(), model.nv);
  if (effects.damping) check(who, "damping", model, effects.damping->size(), model.nv);
  if (effects.friction) check(who, "friction", model, effects.friction->torque.size(), model.nv);
  if (!effects.springs) return;
  check(who, "spring stiffness", model, effects.springs->stiffness.size(), model.nv);
  check(who, "spring rest", model, effects.springs->rest.size(), model.nq);
}

template <class T>
void check_torques(const char* function, const Model<T>& model, const EffectTorques<T>& torques) {
  check(function, "torques", model, torques.tau.size(), model.nv);
}

}  // namespace detail

template <class T>
VectorX<T> model_armature(const Model<T>& model) {
  return detail::joint_values(model, &Joint<T>::armature);
}
template <class T>
VectorX<T> model_damping(const Model<T>& model) {
  return detail::joint_values(model, &Joint<T>::damping);
}
template <class T>
VectorX<T> model_friction(const Model<T>& model) {
  return detail::joint_values(model, &Joint<T>::friction);
}

template <class T>
EffectTorques<T>::EffectTorques(const Model<T>& model) : of_wrenches(model) {
  for (auto* x : {&tau, &dtau_dq, &dtau_dv, &total, &deflection}) *x = VectorX<T>::Zero(model.nv);
}

template <class T>
const VectorX<T>& joint_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::check("joint_torques", "q", model, q.size(), model.nq);
  detail::check("joint_torques", "v", model, v.size(), model.nv);
  detail::check_effects(model, effects);
  detail::check_torques("joint_torques", model, torques);
  VectorX<T>& tau = torques.tau;
  tau.setZero();
  if (effects.damping) tau -= effects.damping->cwiseProduct(v);
  if (effects.friction) {
    for (int k = 0; k < model.nv; ++k) {
      tau[k] -= effects.friction->torque[k] * tanh(v[k] / effects.friction->smoothing);
    }
  }
  if (effects.springs) {
    for (const Joint<T>& joint : model.joints) {
      if (!is_single(joint.type)) continue;
      difference<T>(joint, effects.springs->rest, q, torques.deflection);
      tau[joint.idx_v] -= effects.springs->stiffness[joint.idx_v] * torques.deflection[joint.idx_v];
    }
  }
  return tau;
}

template <class T>
void joint_torque_slopes(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                         const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::check("joint_torque_slopes", "q", model, q.size(), model.nq);
  detail::check("joint_torque_slopes", "v", model, v.size(), model.nv);
  detail::check_effects(model, effects);
  detail::check_torques("joint_torque_slopes", model, torques);
  torques.dtau_dq.setZero();
  torques.dtau_dv.setZero();
  if (effects.damping) torques.dtau_dv -= *effects.damping;
  if (effects.friction) {
    const T& w = effects.friction->smoothing;
    for (int k = 0; k < model.nv; ++k) {
      const T t = tanh(v[k] / w);
      torques.dtau_dv[k] -= effects.friction->torque[k] * ((T(1) - t * t) / w);
    }
  }
  if (!effects.springs) return;
  for (const Joint<T>& joint : model.joints) {
    if (!is_single(joint.type)) continue;
    torques.dtau_dq[joint.idx_v] = -effects.springs->stiffness[joint.idx_v];
  }
}

template <class T>
const VectorX<T>& forward_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& tau) {
  detail::check_arguments("forward_dynamics", model, data, q, &v, &tau, "tau");
  if (!detail::adds_torques(effects)) return aba(model, data, q, v, tau, effects.acting());
  return aba<T>(model, data, q, v, detail::total_torques(model, data, torques, effects, q, v, tau),
                effects.acting());
}

template <class T>
const VectorX<T>& inverse_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& a) {
  rnea(model, data, q, v, a, effects.acting());
  if (detail::adds_torques(effects)) data.tau -= detail::added_torques(model, data, torques, effects, q, v);
  return data.tau;
}

template <class T>
void inverse_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& a) {
  id_derivatives(model, data, q, v, a, effects.acting());
  if (!detail::adds_torques(effects)) return;
  data.tau -= detail::added_torques(model, data, torques, effects, q, v);
  detail::subtract_slopes(model, data, torques, effects, q, v);
}

template <class T>
void forward_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& tau) {
  detail::check_arguments("forward_dynamics_derivatives", model, data, q, &v, &tau, "tau");
  const Acting<T> acting = effects.acting();
  if (!detail::adds_torques(effects)) return fd_derivatives(model, data, q, v, tau, acting);
  detail::total_torques(model, data, torques, effects, q, v, tau);
  detail::derivatives_at_acceleration<T>(model, data, q, v, torques.total, acting);
  detail::subtract_slopes(model, data, torques, effects, q, v);
  detail::solve_columns(model, data, data.dtau_dq, data.ddq_dq);
  detail::solve_columns(model, data, data.dtau_dv, data.ddq_dv);
}

}  // namespace dyntape::dynamics
