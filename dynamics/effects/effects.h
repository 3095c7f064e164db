// SPDX-License-Identifier: BSD-3-Clause
//
// Which effects act on a robot.  What is not chosen is not computed: it leaves no operation on a tape.
//
//   Effects<double> effects;                                   // gravity and velocity products alone
//   effects.damping = model_damping(model);                    // the file's values
//   effects.friction = CoulombFriction<double>{model_friction(model), 0.01};
//   check(model, effects);                                     // check.h: sizes, ranges, bodies
//   EffectTorques<double> torques(model);                      // results and working memory, beside Data
//   VectorX<double> a = forward_dynamics(model, data, torques, effects, q, v, command);
//
// Equation of motion with effects:
//   M(q) a + armature a + C v + g = drive(command) + tau_joints + sum of J^T F
//   drive        what motors can give (saturation.h)
//   tau_joints   damping, friction, springs, soft limits, back-EMF, tendons
//   F            wrenches from outside, drag, buoyancy, contacts (point_forces.h)
// and M holds the armature and the mass of water that is carried along (added_mass.h).
// Each header has its equation, units and smoothness.  Functions look at sizes only; check(), at all values.
//
// To add an effect: a struct in a file of its own, like damping.h, its #include here and its row in effects.def.
// What it has says how it acts, and whoever treats effects alike finds it by for_each_effect:
//   kName, kKey, visit_parameters                            always: for people, for files, its values
//   enter(acting)                                            carried by the recursions, not by torques
//   drive(model, torques)                                    changes torques.driven and driven_slope
//   add_joint_torques(...), add_joint_slopes(...)            torques at single joints, with diagonal derivatives
//   add_torques(...), subtract_slopes(...)                   torques over several joints
//   add_wrenches(data, w)                                    forces on bodies, constant in their axes
//   for_each_point(visit), kReadsVelocity                    forces by the motion of a point (point_forces.h)
//   missing()                                                the parameter that others given call for, or null
//   stored_energy(model, data, q)                            what has a potential
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

  // What the recursions take care of; keeps pointers to the effects' values.
  DynamicsTerms<T> acting() const;
  template <class S>
  Effects<S> cast() const;
};

namespace detail {

// Effects stand as themselves, or in an optional.
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

// The effect that a member of Effects holds: fill one by its visit_parameters, and assign it.
template <class Member>
using effect_type = typename detail::EffectType<std::remove_const_t<Member>>::type;

// visit(effect) for each, chosen or not: `if (effect)` tells whether it is, effect.reset() takes it away.
template <class E, class Visit>
void for_each_effect(E& effects, Visit&& visit) {
#define EFFECT(member, ...) visit(effects.member);
#include <dyntape/dynamics/effects/effects.def>
}
// visit(effect) for those that are chosen, the effects themselves.
template <class E, class Visit>
void for_each_chosen_effect(E& effects, Visit&& visit) {
  for_each_effect(effects, [&](auto& effect) {
    if (effect) visit(detail::effect_in(effect));
  });
}
// visit(name, alone) for each that is chosen, `alone` the effects with no other: energy effect by effect.
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

// For people and for files, whether it is chosen or not.
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

// The robot as it is where these effects act: a model whose own gravity and armature are the effects', and which lacks
// only what no model has, acting().added.
template <class T>
Model<T> acting_model(const Model<T>& robot, const Effects<T>& effects);

// torques.tau, to be added to the driving torques.
template <class T>
const VectorX<T>& joint_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                const VectorRef<T>& q, const VectorRef<T>& v);
// torques.dtau_dq and dtau_dv.
template <class T>
void joint_torque_slopes(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                         const VectorRef<T>& q, const VectorRef<T>& v);

// torques.total: what all effects add to the driving torques; torques.tau is part of it.
template <class T>
const VectorX<T>& effect_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                 const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v);

// torques.driven: what arrives at the joints of commanded torques; and torques.driven_slope, its derivative.
template <class T>
const VectorX<T>& driving_torques(const Model<T>& model, EffectTorques<T>& torques, const Effects<T>& effects,
                                  const VectorRef<T>& command);

// The algorithms of algorithms.h with effects: data.ddq from the commanded torques, data.tau: the torques that are to
// arrive.  Nothing is allocated.
template <class T>
const VectorX<T>& forward_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& command);
template <class T>
const VectorX<T>& inverse_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& a);

// data.ddq, ddq_dq, ddq_dv, Minv; and data.tau, dtau_dq, dtau_dv, M: as fd_derivatives and id_derivatives.
//   d ddq / d command = Minv diag(torques.driven_slope)
template <class T>
void forward_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& command);
template <class T>
void inverse_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& a);

// The power (W) that the chosen effects supply, gravity included, less than zero where they take it:
//   d/dt kinetic_energy(acting) = v . command + effect_power          (with velocity products)
template <class T>
T effect_power(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques, const Effects<T>& effects,
               const VectorRef<T>& q, const VectorRef<T>& v, const VectorRef<T>& command);
// The energy (J) that those of them with a potential store.
template <class T>
T stored_energy(const Model<T>& model, Data<T>& data, const Effects<T>& effects, const VectorRef<T>& q);

}  // namespace dyntape::dynamics
