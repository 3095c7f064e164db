// SPDX-License-Identifier: BSD-3-Clause
//
// Which effects act on a robot.  What is not chosen is not computed: it leaves no operation on a tape.
//
//   Effects<double> effects;                                   // gravity alone
//   effects.damping = model_damping(model);                    // the file's values
//   effects.friction = CoulombFriction<double>{model_friction(model), 0.01};
//   EffectTorques<double> torques(model);                      // results and working memory, beside Data
//   VectorX<double> a = forward_dynamics(model, data, torques, effects, q, v, tau);
//
// Equation of motion with effects:
//   M(q) a + armature a + C v + g = tau + tau_passive + sum of J^T F
//   tau_passive = - d v                      viscous damping d (N m s/rad or N s/m)
//                 - c tanh(v / w)            Coulomb friction c (N m or N), smoothed over w (rad/s or m/s)
//                 - k (q - q_rest)           springs k (N m/rad or N/m); angles of continuous joints
//                                            in [-pi, pi]
//   F                                      wrenches from outside, in the body or the world (wrenches.h)
// All vectors (nv), q_rest (nq).
//
// To add an effect: a struct in a file of its own, like damping.h, and its name in Effects, twice.  What it has
// says how it acts, and whoever treats effects alike finds it by for_each_effect:
//   kName, check(model), cast<S>()                           always
//   enter(acting)                                            carried by the recursions, not by torques
//   add_joint_torques(...), add_joint_slopes(...)            torques at single joints, with diagonal slopes
//   add_torques(...), subtract_slopes(...)                   any other torques
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/armature.h>
#include <dyntape/dynamics/effects/damping.h>
#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/effects/friction.h>
#include <dyntape/dynamics/effects/gravity.h>
#include <dyntape/dynamics/effects/springs.h>
#include <dyntape/dynamics/effects/wrenches.h>

#include <optional>
#include <utility>

namespace dyntape::dynamics {

template <class T>
struct Effects {
  Gravity gravity;
  std::optional<Armature<T>> armature;
  std::optional<Damping<T>> damping;
  std::optional<CoulombFriction<T>> friction;
  std::optional<Springs<T>> springs;
  Wrenches<T> wrenches;

  // What the recursions take care of; keeps a pointer to `armature`.
  Acting<T> acting() const;
  template <class S>
  Effects<S> cast() const;
};

namespace detail {

// Effects stand as themselves, or in an optional.
template <class E>
const E& effect_in(const E& effect) {
  return effect;
}
template <class E>
const E& effect_in(const std::optional<E>& effect) {
  return *effect;
}

template <class S, class E>
auto cast_effect(const E& effect) {
  return effect.template cast<S>();
}
template <class S, class E>
auto cast_effect(const std::optional<E>& effect) {
  return effect ? std::optional(effect->template cast<S>()) : std::nullopt;
}

}  // namespace detail

// use(gravity, armature, ...): all members of Effects, in the order in which they act.
template <class E, class Use>
decltype(auto) with_all_effects(E& effects, Use&& use) {
  auto& [gravity, armature, damping, friction, springs, wrenches] =
      effects;  // one that is missing does not compile
  return use(gravity, armature, damping, friction, springs, wrenches);
}
// visit(effect) for each, chosen or not: `if (effect)` tells whether it is, effect.reset() takes it away.
template <class E, class Visit>
void for_each_effect(E& effects, Visit&& visit) {
  with_all_effects(effects, [&](auto&... effect) { (visit(effect), ...); });
}
// visit(effect) for those that are chosen, the effects themselves.
template <class T, class Visit>
void for_each_chosen_effect(const Effects<T>& effects, Visit&& visit) {
  for_each_effect(effects, [&](const auto& effect) {
    if (effect) visit(detail::effect_in(effect));
  });
}

// For people, whether it is chosen or not.
template <class E>
const char* effect_name(const E&) {
  return E::kName;
}
template <class E>
const char* effect_name(const std::optional<E>&) {
  return E::kName;
}

template <class T>
Acting<T> Effects<T>::acting() const {
  Acting<T> acting{false, false, nullptr, nullptr};
  for_each_chosen_effect(*this, [&](const auto& effect) {
    if constexpr (requires { effect.enter(acting); }) effect.enter(acting);
  });
  return acting;
}

template <class T>
template <class S>
Effects<S> Effects<T>::cast() const {
  return with_all_effects(
      *this, [](const auto&... effect) { return Effects<S>{detail::cast_effect<S>(effect)...}; });
}

// The robot as it is where these effects act: a model whose own gravity and armature are the effects'.
template <class T>
Model<T> acting_model(const Model<T>& robot, const Effects<T>& effects);

// The values of the model, (nv), zero for joints of several columns.
template <class T>
VectorX<T> model_armature(const Model<T>& model);
template <class T>
VectorX<T> model_damping(const Model<T>& model);
template <class T>
VectorX<T> model_friction(const Model<T>& model);

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

// The algorithms of algorithms.h with effects: data.ddq, data.tau.  Nothing is allocated.
template <class T>
const VectorX<T>& forward_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& tau);
template <class T>
const VectorX<T>& inverse_dynamics(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                   const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                   const VectorRef<T>& a);

// data.ddq, ddq_dq, ddq_dv, Minv; and data.tau, dtau_dq, dtau_dv, M: as fd_derivatives and id_derivatives.
template <class T>
void forward_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& tau);
template <class T>
void inverse_dynamics_derivatives(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                  const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                  const VectorRef<T>& a);

}  // namespace dyntape::dynamics
