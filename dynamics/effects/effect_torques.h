// SPDX-License-Identifier: BSD-3-Clause
//
// What effects add to the driving torques: results and working memory, beside Data.
#pragma once

#include <dyntape/dynamics/effects/wrenches.h>

namespace dyntape::dynamics {

template <class T>
struct EffectTorques {
  explicit EffectTorques(const Model<T>& model);

  VectorX<T> tau;               // (nv) of effects at single joints
  VectorX<T> dtau_dq, dtau_dv;  // (nv) their derivatives, which are diagonal
  WrenchTorques<T> of_wrenches;
  VectorX<T> total;  // (nv) of all effects

  // Working memory.
  VectorX<T> deflection;  // (nv)
};

}  // namespace dyntape::dynamics
