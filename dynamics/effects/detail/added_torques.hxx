// SPDX-License-Identifier: BSD-3-Clause
//
// What effects add to the driving torques of an algorithm.
#pragma once

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics::detail {

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

}  // namespace dyntape::dynamics::detail
