// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/effects.h>
#include <dyntape/dynamics/detail/derivatives.hxx>

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

// Calls f(index in v, deflection) for every spring.
template <class T, class F>
void for_each_spring(const Model<T>& model, const Springs<T>& springs, const VectorRef<T>& q, F f) {
  VectorX<T> deflection(model.nv);
  for (const Joint<T>& joint : model.joints) {
    if (!is_single(joint.type)) continue;
    difference<T>(joint, springs.rest, q, deflection);
    f(joint.idx_v, deflection[joint.idx_v]);
  }
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
VectorX<T> joint_torques(const Model<T>& model, const Effects<T>& effects, const VectorRef<T>& q,
                         const VectorRef<T>& v) {
  detail::check("joint_torques", "q", model, q.size(), model.nq);
  detail::check("joint_torques", "v", model, v.size(), model.nv);
  detail::check_effects(model, effects);
  VectorX<T> tau = VectorX<T>::Zero(model.nv);
  if (effects.damping) tau -= effects.damping->cwiseProduct(v);
  if (effects.friction) {
    for (int k = 0; k < model.nv; ++k) {
      tau[k] -= effects.friction->torque[k] * tanh(v[k] / effects.friction->smoothing);
    }
  }
  if (effects.springs) {
    detail::for_each_spring(model, *effects.springs, q,
                            [&](int k, const T& x) { tau[k] -= effects.springs->stiffness[k] * x; });
  }
  return tau;
}

template <class T>
JointTorqueSlopes<T> joint_torque_slopes(const Model<T>& model, const Effects<T>& effects,
                                         const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::check("joint_torque_slopes", "q", model, q.size(), model.nq);
  detail::check("joint_torque_slopes", "v", model, v.size(), model.nv);
  detail::check_effects(model, effects);
  JointTorqueSlopes<T> slopes;
  if (effects.damping || effects.friction) slopes.dv = VectorX<T>::Zero(model.nv);
  if (effects.damping) slopes.dv -= *effects.damping;
  if (effects.friction) {
    const T& w = effects.friction->smoothing;
    for (int k = 0; k < model.nv; ++k) {
      const T t = tanh(v[k] / w);
      slopes.dv[k] -= effects.friction->torque[k] * ((T(1) - t * t) / w);
    }
  }
  if (effects.springs) {
    slopes.dq = VectorX<T>::Zero(model.nv);
    for (const Joint<T>& joint : model.joints) {
      if (!is_single(joint.type)) continue;
      slopes.dq[joint.idx_v] = -effects.springs->stiffness[joint.idx_v];
    }
  }
  return slopes;
}

namespace detail {

template <class T>
bool adds_torques(const Effects<T>& effects) {
  return effects.damping || effects.friction || effects.springs || !effects.wrenches.empty();
}

// What the chosen effects add to the driving torques.
template <class T>
VectorX<T> added_torques(const Model<T>& model, Data<T>& data, const Effects<T>& effects,
                         const VectorRef<T>& q, const VectorRef<T>& v) {
  VectorX<T> tau = joint_torques(model, effects, q, v);
  if (effects.wrenches.empty()) return tau;
  WrenchTorques<T> w(model);
  return tau + wrench_torques(model, data, w, effects.wrenches, q);
}

// Driving torque less what the chosen effects add.
template <class T>
void subtract_slopes(const Model<T>& model, Data<T>& data, const Effects<T>& effects, const VectorRef<T>& q,
                     const VectorRef<T>& v) {
  const JointTorqueSlopes<T> slopes = joint_torque_slopes(model, effects, q, v);
  for (long k = 0; k < slopes.dq.size(); ++k) data.dtau_dq(k, k) -= slopes.dq[k];
  for (long k = 0; k < slopes.dv.size(); ++k) data.dtau_dv(k, k) -= slopes.dv[k];
  if (effects.wrenches.empty()) return;
  WrenchTorques<T> w(model);
  data.dtau_dq -= wrench_torque_derivatives(model, data, w, effects.wrenches, q);
}

}  // namespace detail

template <class T>
const VectorX<T>& forward_dynamics(const Model<T>& model, Data<T>& data, const Effects<T>& effects,
                                   const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau) {
  detail::check_arguments("forward_dynamics", model, data, q, &v, &tau, "tau");
  if (!detail::adds_torques(effects)) return aba(model, data, q, v, tau, effects.acting());
  const VectorX<T> total = tau + detail::added_torques(model, data, effects, q, v);
  return aba<T>(model, data, q, v, total, effects.acting());
}

template <class T>
const VectorX<T>& inverse_dynamics(const Model<T>& model, Data<T>& data, const Effects<T>& effects,
                                   const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& a) {
  rnea(model, data, q, v, a, effects.acting());
  if (detail::adds_torques(effects)) data.tau -= detail::added_torques(model, data, effects, q, v);
  return data.tau;
}

template <class T>
void inverse_dynamics_derivatives(const Model<T>& model, Data<T>& data, const Effects<T>& effects,
                                  const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& a) {
  id_derivatives(model, data, q, v, a, effects.acting());
  if (!detail::adds_torques(effects)) return;
  data.tau -= detail::added_torques(model, data, effects, q, v);
  detail::subtract_slopes(model, data, effects, q, v);
}

template <class T>
void forward_dynamics_derivatives(const Model<T>& model, Data<T>& data, const Effects<T>& effects,
                                  const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& tau) {
  detail::check_arguments("forward_dynamics_derivatives", model, data, q, &v, &tau, "tau");
  const Acting<T> acting = effects.acting();
  if (!detail::adds_torques(effects)) return fd_derivatives(model, data, q, v, tau, acting);
  const VectorX<T> total = tau + detail::added_torques(model, data, effects, q, v);
  detail::place_joints(model, data, q);
  detail::derivatives_at_acceleration<T>(model, data, v, total, acting);
  detail::subtract_slopes(model, data, effects, q, v);
  detail::solve_columns(model, data, data.dtau_dq, data.ddq_dq);
  detail::solve_columns(model, data, data.dtau_dv, data.ddq_dv);
}

}  // namespace dyntape::dynamics
