// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>

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
  for_each_chosen_effect(effects, [&](const auto& effect) { effect.check(model); });
}

template <class T>
void check_torques(const char* function, const Model<T>& model, const EffectTorques<T>& torques) {
  check(function, "torques", model, torques.tau.size(), model.nv);
}

template <class T>
bool adds_torques(const Effects<T>& effects) {
  bool adds = false;
  for_each_chosen_effect(effects, [&]<class E>(const E&) {
    adds = adds || requires { &E::add_joint_torques; }
    || requires { &E::add_torques; };
  });
  return adds;
}

// torques.total: and the driving torques.
template <class T>
const VectorX<T>& total_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                const VectorRef<T>& tau) {
  effect_torques(model, data, torques, effects, q, v);
  torques.total = tau + torques.total;
  return torques.total;
}

// data.dtau_dq and dtau_dv less what the chosen effects add.
template <class T>
void subtract_slopes(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                     const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v) {
  joint_torque_slopes(model, torques, effects, q, v);
  data.dtau_dq.diagonal() -= torques.dtau_dq;
  data.dtau_dv.diagonal() -= torques.dtau_dv;
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.subtract_slopes(model, data, torques, q); })
      effect.subtract_slopes(model, data, torques, q);
  });
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
  torques.tau.setZero();
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.add_joint_torques(model, torques, q, v); })
      effect.add_joint_torques(model, torques, q, v);
  });
  return torques.tau;
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
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.add_joint_slopes(model, torques, v); })
      effect.add_joint_slopes(model, torques, v);
  });
}

template <class T>
const VectorX<T>& effect_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                 const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v) {
  torques.total = joint_torques(model, torques, effects, q, v);
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.add_torques(model, data, torques, q); })
      effect.add_torques(model, data, torques, q);
  });
  return torques.total;
}

template <class T>
Model<T> acting_model(const Model<T>& robot, const Effects<T>& effects) {
  const Acting<T> acting = effects.acting();
  Model<T> model = robot;
  if (!acting.gravity) model.gravity.setZero();
  for (int i = 0; i < model.njoints(); ++i) model.joints[i].armature = detail::armature_at(robot, acting, i);
  return model;
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
  if (detail::adds_torques(effects)) data.tau -= effect_torques(model, data, torques, effects, q, v);
  return data.tau;
}

template <class T>
void inverse_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& a) {
  id_derivatives(model, data, q, v, a, effects.acting());
  if (!detail::adds_torques(effects)) return;
  data.tau -= effect_torques(model, data, torques, effects, q, v);
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

#define DYNTAPE_INSTANTIATE_EFFECTS(T)                 \
  template struct dyntape::dynamics::EffectTorques<T>; \
  DYNTAPE_COMPILE(model_armature, T)                   \
  DYNTAPE_COMPILE(model_damping, T)                    \
  DYNTAPE_COMPILE(model_friction, T)                   \
  DYNTAPE_COMPILE(joint_torques, T)                    \
  DYNTAPE_COMPILE(joint_torque_slopes, T)              \
  DYNTAPE_COMPILE(acting_model, T)                     \
  DYNTAPE_COMPILE(effect_torques, T)                   \
  DYNTAPE_COMPILE(forward_dynamics, T)                 \
  DYNTAPE_COMPILE(inverse_dynamics, T)                 \
  DYNTAPE_COMPILE(forward_dynamics_derivatives, T)     \
  DYNTAPE_COMPILE(inverse_dynamics_derivatives, T)
