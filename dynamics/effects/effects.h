// SPDX-License-Identifier: BSD-3-Clause
//
// The effects that act on a robot: gravity, damping, friction, springs, motors, contacts, ...  Choose them here; an
// effect that is not chosen adds no operation to a tape.
//
//   Effects<double> effects;                                   // gravity and velocity products alone
//   effects.damping = model_damping(model);                    // the file's values
//   effects.friction = CoulombFriction<double>{model_friction(model), 0.01};
//   check(model, effects);                                     // check.h: sizes, ranges, bodies
//   EffectTorques<double> torques(model);                      // results and working memory, beside Data
//   VectorX<double> a = forward_dynamics(model, data, torques, effects, q, v, command);
//
// Equation of motion with effects:
//   M(q) a + C v + g = drive(command) + tau_joints + sum of J^T F
//   drive        the torques of the motors, with saturation (saturation.h)
//   tau_joints   damping, friction, springs, soft limits, back-EMF, tendons
//   F            external wrenches, drag, buoyancy, contacts (point_forces.h)
// M includes the armature and the added mass of water (added_mass.h).  Each effect's header has its equation, units
// and smoothness.  Functions check sizes only; check() checks all values.
//
// To add an effect: write a struct in its own file, like damping.h; add its #include here and its row to
// effects.def.  The members of the struct define how the effect acts; for_each_effect visits all effects:
//   kName, kKey, visit_parameters                            required: name, key in files, parameters
//   enter(acting)                                            part of the recursions, not a torque
//   drive(model, torques)                                    changes torques.driven and driven_slope
//   add_joint_torques(...), add_joint_slopes(...)            torques at single joints, with diagonal derivatives
//   add_torques(...), subtract_slopes(...)                   torques over several joints
//   add_wrenches(data, w)                                    forces on bodies, constant in the body's axes
//   for_each_point(visit), kReadsVelocity                    forces from the motion of a point (point_forces.h)
//   missing()                                                a parameter that other parameters require, or null
//   stored_energy(model, data, q)                            the potential energy, if any
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/added_mass.h>
#include <dyntape/dynamics/effects/armature.h>
#include <dyntape/dynamics/effects/back_emf.h>
#include <dyntape/dynamics/effects/buoyancy.h>
#include <dyntape/dynamics/effects/contacts.h>
#include <dyntape/dynamics/effects/coriolis.h>
#include <dyntape/dynamics/effects/damping.h>
#include <dyntape/dynamics/effects/drag.h>
#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/effects/friction.h>
#include <dyntape/dynamics/effects/gravity.h>
#include <dyntape/dynamics/effects/joint_limits.h>
#include <dyntape/dynamics/effects/saturation.h>
#include <dyntape/dynamics/effects/springs.h>
#include <dyntape/dynamics/effects/tendons.h>
#include <dyntape/dynamics/effects/wrenches.h>

#include <optional>

namespace dyntape::dynamics {

template <class T>
struct Effects {
#define EFFECT(member, ...) __VA_ARGS__ member;
#include <dyntape/dynamics/effects/effects.def>

  // The terms for the recursions; holds pointers to the effects' values.
  DynamicsTerms<T> acting() const;
  template <class S>
  Effects<S> cast() const;
};

namespace detail {

// A member is an effect or an optional effect.
template <class E>
E& effect_in(E& effect) {
  return effect;
}
template <class E>
const E& effect_in(const std::optional<E>& effect) {
  return *effect;
}
template <class E>
E& effect_in(std::optional<E>& effect) {
  return *effect;
}

template <class Member>
struct EffectType {
  using type = Member;
};
template <class E>
struct EffectType<std::optional<E>> {
  using type = E;
};

}  // namespace detail

// The effect type of a member of Effects: fill a value by its visit_parameters, then assign it.
template <class Member>
using effect_type = typename detail::EffectType<std::remove_const_t<Member>>::type;

// Calls visit(effect) for each effect, chosen or not.  `if (effect)` tests whether it is chosen; effect.reset()
// removes it.
template <class E, class Visit>
void for_each_effect(E& effects, Visit&& visit) {
#define EFFECT(member, ...) visit(effects.member);
#include <dyntape/dynamics/effects/effects.def>
}
// Calls visit(effect) for each chosen effect, with the effect itself.
template <class E, class Visit>
void for_each_chosen_effect(E& effects, Visit&& visit) {
  for_each_effect(effects, [&](auto& effect) {
    if (effect) visit(detail::effect_in(effect));
  });
}
// Calls visit(name, alone) for each chosen effect.  `alone` holds this effect only, e.g. for its energy.
template <class T, class Visit>
void for_each_effect_alone(const Effects<T>& effects, Visit&& visit) {
  for_each_effect(effects, [&](const auto& chosen) {
    if (!chosen) return;
    Effects<T> alone = effects;
    for_each_effect(alone, [&](auto& other) {
      if constexpr (std::is_same_v<std::decay_t<decltype(other)>, std::decay_t<decltype(chosen)>>) return;
      other.reset();
    });
    visit(detail::effect_in(chosen).kName, alone);
  });
}

// Name and key of a member, whether it is chosen or not.
template <class E>
const char* effect_name(const E&) {
  return effect_type<E>::kName;
}
template <class E>
const char* effect_key(const E&) {
  return effect_type<E>::kKey;
}

template <class T>
DynamicsTerms<T> Effects<T>::acting() const {
  DynamicsTerms<T> acting;
  acting.gravity = acting.armature = acting.coriolis = false;
  for_each_chosen_effect(*this, [&](const auto& effect) {
    if constexpr (requires { effect.enter(acting); }) effect.enter(acting);
  });
  return acting;
}

template <class T>
template <class S>
Effects<S> Effects<T>::cast() const {
  Effects<S> result;
#define EFFECT(member, ...) result.member = detail::cast_effect<S>(member);
#include <dyntape/dynamics/effects/effects.def>
  return result;
}

// Returns the robot with the gravity and armature of the effects.  Only acting().added, which a model cannot hold,
// is missing.
template <class T>
Model<T> acting_model(const Model<T>& robot, const Effects<T>& effects);

// Returns torques.tau, the torques to add to the driving torques.
template <class T>
const VectorX<T>& joint_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                const VectorRef<T>& q, const VectorRef<T>& v);
// Computes torques.dtau_dq and dtau_dv.
template <class T>
void joint_torque_slopes(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                         const VectorRef<T>& q, const VectorRef<T>& v);

// Returns torques.total, the sum of what all effects add to the driving torques; it includes torques.tau.
template <class T>
const VectorX<T>& effect_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                 const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v);

// Returns torques.driven, the torques at the joints for commanded torques; also torques.driven_slope, its
// derivative.
template <class T>
const VectorX<T>& driving_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                  const VectorRef<T>& command);

// Forward and inverse dynamics with effects (algorithms.h).  data.ddq: from the commanded torques.  data.tau: the
// torques required at the joints.  Do not allocate.
template <class T>
const VectorX<T>& forward_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& command);
template <class T>
const VectorX<T>& inverse_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& a);

// Compute data.ddq, ddq_dq, ddq_dv, Minv, and data.tau, dtau_dq, dtau_dv, M, like fd_derivatives and id_derivatives.
//   d ddq / d command = Minv diag(torques.driven_slope)
template <class T>
void forward_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& command);
template <class T>
void inverse_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& a);

// The power (W) that the chosen effects supply, including gravity; negative if they dissipate:
//   d/dt kinetic_energy(acting) = v . command + effect_power          (with velocity products)
template <class T>
T effect_power(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques, const Effects<T>& effects,
               const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& command);
// The potential energy (J) of the chosen effects.
template <class T>
T stored_energy(const Model<T>& model, Data<T>& data, const Effects<T>& effects, const VectorRef<T>& q);

}  // namespace dyntape::dynamics
