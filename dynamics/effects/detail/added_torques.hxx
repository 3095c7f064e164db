// SPDX-License-Identifier: BSD-3-Clause
//
// What effects add to the driving torques of an algorithm.
#pragma once

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/model/detail/checks.hxx>

namespace dyntape::dynamics::detail {

template <class T>
bool adds_torques(const Effects<T>& effects) {
  return effects.damping || effects.friction || effects.springs || !effects.wrenches.empty();
}

// torques.total: what the chosen effects add to the driving torques.
template <class T>
const VectorX<T>& added_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v) {
  torques.total = joint_torques(model, torques, effects, q, v);
  if (!effects.wrenches.empty()) {
    torques.total += wrench_torques(model, data, torques.of_wrenches, effects.wrenches, q);
  }
  return torques.total;
}

// torques.total: and the driving torques.
template <class T>
const VectorX<T>& total_torques(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                                const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v,
                                const VectorRef<T>& tau) {
  added_torques(model, data, torques, effects, q, v);
  torques.total = tau + torques.total;
  return torques.total;
}

// data.dtau_dq and dtau_dv less what the chosen effects add.
template <class T>
void subtract_slopes(const Model<T>& model, Data<T>& data, EffectTorques<T>& torques,
                     const Effects<T>& effects, const VectorRef<T>& q, const VectorRef<T>& v) {
  joint_torque_slopes(model, torques, effects, q, v);
  if (effects.springs) data.dtau_dq.diagonal() -= torques.dtau_dq;
  if (effects.damping || effects.friction) data.dtau_dv.diagonal() -= torques.dtau_dv;
  if (effects.wrenches.empty()) return;
  data.dtau_dq -= wrench_torque_derivatives(model, data, torques.of_wrenches, effects.wrenches, q);
}

}  // namespace dyntape::dynamics::detail
