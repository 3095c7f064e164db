// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/detail/effects.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_EFFECTS(T)                                                                       \
  namespace dyntape::dynamics {                                                                              \
  template VectorX<T> model_armature(const Model<T>&);                                                       \
  template VectorX<T> model_damping(const Model<T>&);                                                        \
  template VectorX<T> model_friction(const Model<T>&);                                                       \
  template VectorX<T> joint_torques(const Model<T>&, const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T));         \
  template JointTorqueSlopes<T> joint_torque_slopes(const Model<T>&, const Effects<T>&, DYNTAPE_V(T),        \
      DYNTAPE_V(T));                                                                                         \
  template const VectorX<T>& forward_dynamics(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),  \
      DYNTAPE_V(T));                                                                                         \
  template const VectorX<T>& inverse_dynamics(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),  \
      DYNTAPE_V(T));                                                                                         \
  template void forward_dynamics_derivatives(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),   \
      DYNTAPE_V(T));                                                                                         \
  template void inverse_dynamics_derivatives(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),   \
      DYNTAPE_V(T));                                                                                         \
  }
// clang-format on
