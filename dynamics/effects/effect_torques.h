// SPDX-License-Identifier: BSD-3-Clause
//
// Results and working memory of effects, beside Data: their torques and derivatives.
#pragma once

#include <dyntape/dynamics/algorithms/kinematic_derivatives.h>
#include <dyntape/dynamics/effects/parameters.h>
#include <dyntape/dynamics/effects/wrenches.h>

namespace dyntape::dynamics {

template <class T>
struct EffectTorques {
  explicit EffectTorques(const Model<T>& model);

  VectorX<T> tau;                // (nv) of effects at single joints
  VectorX<T> dtau_dq, dtau_dv;   // (nv) their derivatives, which are diagonal
  WrenchTorques<T> of_wrenches;  // of all forces on bodies
  VectorX<T> total;              // (nv) of all effects; with a command, including the driving torques
  VectorX<T> driven,
      driven_slope;  // (nv) torques at the joints for the commanded torques; derivative by the command

  // Working memory.
  KinematicDerivatives<T> motions;
};

}  // namespace dyntape::dynamics
