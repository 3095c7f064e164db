// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>
#include <dyntape/dynamics/effects/detail/wrenches.hxx>

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

// Sizes of vectors and numbers of bodies: what the loops rely on.
template <class T, class E>
void check_sizes(const Model<T>& model, const E& effect) {
  E::visit_parameters(effect, [&]<class X>(const ParameterInfo& info, const X& value) {
    const auto check_length = [&](const auto& x) {
      const int expected = info.length == Length::kConfiguration ? model.nq : model.nv;
      if (x.size() != expected) check("effects", info.name, model, x.size(), expected);
    };
    if constexpr (std::is_same_v<X, VectorX<T>> || std::is_same_v<X, Eigen::VectorXd>) check_length(value);
    if constexpr (std::is_same_v<X, std::optional<VectorX<T>>>) {
      if (value) check_length(*value);
    }
  });
  if constexpr (requires { effect.X_BF; }) {
    if (effect.body >= 0) check_body("effects", model, effect.body);
  }
  if constexpr (requires { typename E::Item; }) {
    for (const auto& item : effect) check_sizes(model, item);
  }
}

template <class T>
void check_effects(const char* function, const Model<T>& model, const Effects<T>& effects,
                   const EffectTorques<T>& torques) {
  for_each_chosen_effect(effects, [&](const auto& effect) { check_sizes(model, effect); });
  check(function, "torques", model, torques.tau.size(), model.nv);
  check_count(function, "torques", model, std::ssize(torques.of_wrenches.sums));
}

template <class E>
inline constexpr bool kActsOnBodies = requires(const E& e) {
  &E::add_wrenches;
}
|| requires { E::kReadsVelocity; };

// any_chosen<T>(effects, []<class E>() { return ...; })
template <class T, class Has>
bool any_chosen(const Effects<T>& effects, Has has) {
  bool any = false;
  for_each_chosen_effect(effects, [&]<class E>(const E&) { any = any || has.template operator()<E>(); });
  return any;
}

template <class T>
bool adds_torques(const Effects<T>& effects) {
  return any_chosen(effects, []<class E>() {
    return kActsOnBodies<E> || requires { &E::add_joint_torques; }
    || requires { &E::add_torques; }
    || requires { &E::drive; };
  });
}
template <class T>
bool acts_on_bodies(const Effects<T>& effects) {
  return any_chosen(effects, []<class E>() { return kActsOnBodies<E>; });
}

// data.X_WB, and data.v where an effect reads it.
template <class T>
void move_for_effects(const Model<T>& model, Data<T>& data, const Effects<T>& effects, const VectorRef<T>& q,
                      const VectorRef<T>& v) {
  const bool moving = any_chosen(effects, []<class E>() {
    return requires { E::kReadsVelocity; };
  });
  moving ? forward_kinematics(model, data, q, v) : forward_kinematics(model, data, q);
}

// visit(body, r, law) for each point of a body that an effect acts at.
template <class T, class Visit>
void for_each_point(const Effects<T>& effects, Visit visit) {
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.for_each_point(visit); }) {
      effect.for_each_point([&](int body, const Vector3<T>& r, const auto& law) {
        if (body >= 0) visit(body, r, law);
      });
    }
  });
}

// w.sums and w.tau of all forces on bodies.
template <class T>
void gather_forces_on_bodies(const Model<T>& model, Data<T>& data, WrenchTorques<T>& w,
                             const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v) {
  move_for_effects(model, data, effects, q, v);
  clear_wrenches(w);
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.add_wrenches(data, w); }) effect.add_wrenches(data, w);
  });
  for_each_point<T>(effects, [&](int body, const Vector3<T>& r, const auto& law) {
    add_point_force(data, w, body, r, law.force(point_motion(data, body, r)));
  });
  gather_wrenches(model, data, w);
}

// torques.total: and what the command drives.
template <class T>
const VectorX<T>& total_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                const VectorRef<T>& command) {
  effect_torques(model, data, torques, effects, q, v);
  torques.total = driving_torques(model, torques, effects, command) + torques.total;
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
    if constexpr (requires { effect.subtract_slopes(model, data, q, v); })
      effect.subtract_slopes(model, data, q, v);
  });
  if (!acts_on_bodies(effects)) return;
  gather_forces_on_bodies(model, data, torques.of_wrenches, effects, q, v);
  differentiate_wrenches(model, data, torques.of_wrenches);
  data.dtau_dq -= torques.of_wrenches.dtau_dq;
  for_each_point<T>(effects, [&](int body, const Vector3<T>& r, const auto& law) {
    subtract_point_slopes(model, data, torques.motions, body, r,
                          law.derivatives(point_motion(data, body, r)));
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
VectorX<double> model_effort(const Model<T>& model) {
  VectorX<double> values = VectorX<double>::Constant(model.nv, JointLimits::kNone);
  for (const Joint<T>& joint : model.joints) {
    if (is_single(joint.type)) values[joint.idx_v] = joint.limits.effort;
  }
  return values;
}

template <class T>
EffectTorques<T>::EffectTorques(const Model<T>& model) : of_wrenches(model), motions(model) {
  for (auto* x : {&tau, &dtau_dq, &dtau_dv, &total, &driven, &driven_slope}) *x = VectorX<T>::Zero(model.nv);
}

template <class T>
const VectorX<T>& joint_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                const VectorRef<T>& q, const VectorRef<T>& v) {
  detail::check("joint_torques", "q", model, q.size(), model.nq);
  detail::check("joint_torques", "v", model, v.size(), model.nv);
  detail::check_effects("joint_torques", model, effects, torques);
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
  detail::check_effects("joint_torque_slopes", model, effects, torques);
  torques.dtau_dq.setZero();
  torques.dtau_dv.setZero();
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.add_joint_slopes(model, torques, q, v); })
      effect.add_joint_slopes(model, torques, q, v);
  });
}

template <class T>
const VectorX<T>& effect_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                 const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v) {
  torques.total = joint_torques(model, torques, effects, q, v);
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.add_torques(model, torques, q, v); })
      effect.add_torques(model, torques, q, v);
  });
  if (!detail::acts_on_bodies(effects)) return torques.total;
  detail::check_arguments("effect_torques", model, data, q);
  detail::gather_forces_on_bodies(model, data, torques.of_wrenches, effects, q, v);
  torques.total += torques.of_wrenches.tau;
  return torques.total;
}

template <class T>
const VectorX<T>& driving_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                  const VectorRef<T>& command) {
  detail::check("driving_torques", "command", model, command.size(), model.nv);
  detail::check_effects("driving_torques", model, effects, torques);
  torques.driven = command;
  torques.driven_slope.setConstant(T(1));
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.drive(model, torques); }) effect.drive(model, torques);
  });
  return torques.driven;
}

template <class T>
Model<T> acting_model(const Model<T>& robot, const Effects<T>& effects) {
  const DynamicsTerms<T> acting = effects.acting();
  Model<T> model = robot;
  if (acting.gravity_value) model.gravity = *acting.gravity_value;
  if (!acting.gravity) model.gravity.setZero();
  for (int i = 0; i < model.njoints(); ++i) model.joints[i].armature = detail::armature_at(robot, acting, i);
  return model;
}

template <class T>
const VectorX<T>& forward_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& command) {
  detail::check_arguments("forward_dynamics", model, data, q, &v, &command, "command");
  if (!detail::adds_torques(effects)) return aba(model, data, q, v, command, effects.acting());
  return aba<T>(model, data, q, v, detail::total_torques(model, data, torques, effects, q, v, command),
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
                                  const VectorRef<T>& command) {
  detail::check_arguments("forward_dynamics_derivatives", model, data, q, &v, &command, "command");
  const DynamicsTerms<T> acting = effects.acting();
  if (!detail::adds_torques(effects)) {
    driving_torques(model, torques, effects, command);
    return fd_derivatives(model, data, q, v, command, acting);
  }
  detail::total_torques(model, data, torques, effects, q, v, command);
  detail::derivatives_at_acceleration<T>(model, data, q, v, torques.total, acting);
  detail::subtract_slopes(model, data, torques, effects, q, v);
  detail::solve_columns(model, data, data.dtau_dq, data.ddq_dq);
  detail::solve_columns(model, data, data.dtau_dv, data.ddq_dv);
}

template <class T>
T effect_power(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques, const Effects<T>& effects,
               const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& command) {
  DynamicsTerms<T> falling = effects.acting();
  falling.coriolis = false;
  falling.added = {};  // without weight
  T power = T(0);      // of effects that only change the inertia, and on a tape without an operation
  if (detail::adds_torques(effects)) power += v.dot(effect_torques(model, data, torques, effects, q, v));
  if (detail::any_chosen(effects, []<class E>() {
        return requires { &E::drive; };
      }))
    power += v.dot(VectorX<T>(driving_torques(model, torques, effects, command) - command));
  if (falling.gravity) power -= v.dot(nonlinear_effects(model, data, q, v, falling));
  return power;
}

template <class T>
T stored_energy(const Model<T>& model, Data<T>& data, const Effects<T>& effects, const VectorRef<T>& q) {
  forward_kinematics(model, data, q);
  T energy = T(0);
  for_each_chosen_effect(effects, [&](const auto& effect) {
    if constexpr (requires { effect.stored_energy(model, data, q); })
      energy += effect.stored_energy(model, data, q);
  });
  detail::for_each_point<T>(effects, [&](int body, const Vector3<T>& r, const auto& law) {
    const PointMotion<T> at{data.X_WB[body].R * r + data.X_WB[body].p};
    if constexpr (requires { law.stored_energy(at); }) energy += law.stored_energy(at);
  });
  return energy;
}

}  // namespace dyntape::dynamics

#define DYNTAPE_INSTANTIATE_EFFECTS(T, ...)                        \
  __VA_ARGS__ template struct dyntape::dynamics::EffectTorques<T>; \
  DYNTAPE_COMPILE(model_armature, T, __VA_ARGS__)                  \
  DYNTAPE_COMPILE(model_damping, T, __VA_ARGS__)                   \
  DYNTAPE_COMPILE(model_friction, T, __VA_ARGS__)                  \
  DYNTAPE_COMPILE(model_effort, T, __VA_ARGS__)                    \
  DYNTAPE_COMPILE(joint_torques, T, __VA_ARGS__)                   \
  DYNTAPE_COMPILE(joint_torque_slopes, T, __VA_ARGS__)             \
  DYNTAPE_COMPILE(acting_model, T, __VA_ARGS__)                    \
  DYNTAPE_COMPILE(effect_torques, T, __VA_ARGS__)                  \
  DYNTAPE_COMPILE(driving_torques, T, __VA_ARGS__)                 \
  DYNTAPE_COMPILE(effect_power, T, __VA_ARGS__)                    \
  DYNTAPE_COMPILE(stored_energy, T, __VA_ARGS__)                   \
  DYNTAPE_COMPILE(forward_dynamics, T, __VA_ARGS__)                \
  DYNTAPE_COMPILE(inverse_dynamics, T, __VA_ARGS__)                \
  DYNTAPE_COMPILE(forward_dynamics_derivatives, T, __VA_ARGS__)    \
  DYNTAPE_COMPILE(inverse_dynamics_derivatives, T, __VA_ARGS__)

DYNTAPE_DECLARE_BUILT_IN(DYNTAPE_INSTANTIATE_EFFECTS)
