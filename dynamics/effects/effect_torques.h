// SPDX-License-Identifier: BSD-3-Clause
//
// What effects add to the driving torques: results and working memory, beside Data.
#pragma once

#include <dyntape/dynamics/algorithms/kinematic_derivatives.h>
#include <dyntape/dynamics/effects/parameters.h>
#include <dyntape/dynamics/effects/wrenches.h>

namespace dyntape::dynamics {

template <class T>
struct EffectTorques {
  explicit EffectTorques(const Model<T>& model);

  VectorX<T> tau;                   // (nv) of effects at single joints
  VectorX<T> dtau_dq, dtau_dv;      // (nv) their derivatives, which are diagonal
  WrenchTorques<T> of_wrenches;     // of all forces on bodies
  VectorX<T> total;                 // (nv) of all effects; where a command is given, with what it drives
  VectorX<T> driven, driven_slope;  // (nv) what arrives of the commanded torques; its derivative by them

  // Working memory.
  KinematicDerivatives<T> motions;
};

}  // namespace dyntape::dynamics
