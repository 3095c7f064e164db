// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/contact/detail/constraint_derivatives.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_CONSTRAINTS(T)                                                                   \
  namespace dyntape::dynamics {                                                                              \
  template struct ConstraintData<T>;                                                                         \
  template Constraint<T> point_constraint(const Model<T>&, int, const Vector3<T>&);                          \
  template Constraint<T> frame_constraint(const Model<T>&, int, const Placement<T>&);                        \
  template Constraint<T> loop_constraint(const Model<T>&, int, int, int);                                    \
  template void constraint_kinematics(DYNTAPE_MD(T), ConstraintData<T>&, DYNTAPE_V(T), DYNTAPE_V(T));        \
  template const VectorX<T>& constrained_dynamics(DYNTAPE_MD(T), ConstraintData<T>&, DYNTAPE_V(T),           \
      DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);                                                         \
  template void constrained_dynamics_derivatives(DYNTAPE_MD(T), ConstraintData<T>&, DYNTAPE_V(T),            \
      DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);                                                         \
  template const VectorX<T>& constrained_dynamics(DYNTAPE_MD(T), ConstraintData<T>&, EffectTorques<T>&,      \
      const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));                                          \
  template void constrained_dynamics_derivatives(DYNTAPE_MD(T), ConstraintData<T>&, EffectTorques<T>&,       \
      const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));                                          \
  template const VectorX<T>& impulse_dynamics(DYNTAPE_MD(T), ConstraintData<T>&, DYNTAPE_V(T),               \
      DYNTAPE_V(T), const T&, const Acting<T>&);                                                             \
  template void impulse_dynamics_derivatives(DYNTAPE_MD(T), ConstraintData<T>&, DYNTAPE_V(T),                \
      DYNTAPE_V(T), const T&, const Acting<T>&);                                                             \
  }
// clang-format on
