// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/effects/detail/effects.hxx>

#define DYNTAPE_ME(T) const Model<T>&, EffectTorques<T>&, const Effects<T>&

// clang-format off
#define DYNTAPE_INSTANTIATE_EFFECTS(T)                                                                       \
  namespace dyntape::dynamics {                                                                              \
  template VectorX<T> model_armature(const Model<T>&);                                                       \
  template VectorX<T> model_damping(const Model<T>&);                                                        \
  template VectorX<T> model_friction(const Model<T>&);                                                       \
  template struct EffectTorques<T>;                                                                          \
  template const VectorX<T>& joint_torques(DYNTAPE_ME(T), DYNTAPE_V(T), DYNTAPE_V(T));                       \
  template void joint_torque_slopes(DYNTAPE_ME(T), DYNTAPE_V(T), DYNTAPE_V(T));                              \
  template Model<T> acting_model(const Model<T>&, const Effects<T>&);                                        \
  template const VectorX<T>& effect_torques(DYNTAPE_MDE(T), DYNTAPE_V(T), DYNTAPE_V(T));                     \
  template const VectorX<T>& forward_dynamics(DYNTAPE_MDE(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));     \
  template const VectorX<T>& inverse_dynamics(DYNTAPE_MDE(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));     \
  template void forward_dynamics_derivatives(DYNTAPE_MDE(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));      \
  template void inverse_dynamics_derivatives(DYNTAPE_MDE(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));      \
  }
// clang-format on
