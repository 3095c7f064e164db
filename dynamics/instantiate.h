// SPDX-License-Identifier: BSD-3-Clause
//
// All algorithms for one more scalar, compiled once, in a unit of its own:
//
//   #include "my_scalar.h"                      // arithmetic, sqrt, sin, ..., select, Eigen's NumTraits
//   #include <dyntape/dynamics/instantiate.h>
//   DYNTAPE_INSTANTIATE_DYNAMICS(my::Scalar)    // at global scope
//
// Everybody else includes algorithms.h, configuration.h and effects.h, which only declare.
#pragma once

#include <dyntape/dynamics/detail/configuration.hxx>
#include <dyntape/dynamics/detail/derivatives.hxx>
#include <dyntape/dynamics/detail/effects.hxx>
#include <dyntape/dynamics/detail/forward_dynamics.hxx>
#include <dyntape/dynamics/detail/inverse_dynamics.hxx>
#include <dyntape/dynamics/detail/kinematics.hxx>

// Shorthands of the lists below, T the scalar: model and data; vector arguments.
#define DYNTAPE_MD(T) const Model<T>&, Data<T>&
#define DYNTAPE_V(T) const VectorRef<T>&

// clang-format off
#define DYNTAPE_INSTANTIATE_DYNAMICS(T)                                                                       \
  namespace dyntape::dynamics {                                                                               \
  template void forward_kinematics(DYNTAPE_MD(T), DYNTAPE_V(T));                                              \
  template void forward_kinematics(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T));                                \
  template void forward_kinematics(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));                  \
  template Placement<T> frame_placement(const Model<T>&, const Data<T>&, int);                                \
  template Motion<T> frame_velocity(const Model<T>&, const Data<T>&, int, ReferenceFrame);                    \
  template Motion<T> frame_acceleration(const Model<T>&, const Data<T>&, int, ReferenceFrame);                \
  template Motion<T> frame_classical_acceleration(const Model<T>&, const Data<T>&, int, ReferenceFrame);      \
  template const Matrix6X<T>& frame_jacobian(DYNTAPE_MD(T), DYNTAPE_V(T), int, ReferenceFrame);               \
  template const VectorX<T>& rnea(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&); \
  template const VectorX<T>& nonlinear_effects(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);  \
  template const VectorX<T>& generalized_gravity(DYNTAPE_MD(T), DYNTAPE_V(T));                                \
  template const MatrixX<T>& crba(DYNTAPE_MD(T), DYNTAPE_V(T), const Acting<T>&);                             \
  template const VectorX<T>& aba(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);  \
  template const MatrixX<T>& minverse(DYNTAPE_MD(T), DYNTAPE_V(T), const Acting<T>&);                         \
  template void id_derivatives(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);    \
  template void fd_derivatives(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);    \
  template const T& kinetic_energy(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);              \
  template const T& potential_energy(DYNTAPE_MD(T), DYNTAPE_V(T));                                            \
  template const Vector3<T>& center_of_mass(DYNTAPE_MD(T), DYNTAPE_V(T));                                     \
  template VectorX<T> integrate(const Model<T>&, DYNTAPE_V(T), DYNTAPE_V(T));                                 \
  template VectorX<T> difference(const Model<T>&, DYNTAPE_V(T), DYNTAPE_V(T));                                \
  template TangentJacobians<T> integrate_jacobians(const Model<T>&, DYNTAPE_V(T));                            \
  template TangentJacobians<T> difference_jacobians(const Model<T>&, DYNTAPE_V(T));                           \
  template VectorX<T> neutral(const Model<T>&);                                                               \
  template VectorX<T> random_configuration(const Model<T>&, std::mt19937_64&);                                \
  template VectorX<T> model_armature(const Model<T>&);                                                        \
  template VectorX<T> model_damping(const Model<T>&);                                                         \
  template VectorX<T> model_friction(const Model<T>&);                                                        \
  template VectorX<T> joint_torques(const Model<T>&, const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T));          \
  template JointTorqueSlopes<T> joint_torque_slopes(const Model<T>&, const Effects<T>&, DYNTAPE_V(T),         \
                                                    DYNTAPE_V(T));                                            \
  template const VectorX<T>& forward_dynamics(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),   \
                                              DYNTAPE_V(T));                                                  \
  template const VectorX<T>& inverse_dynamics(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),   \
                                              DYNTAPE_V(T));                                                  \
  template void forward_dynamics_derivatives(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),    \
                                             DYNTAPE_V(T));                                                   \
  template void inverse_dynamics_derivatives(DYNTAPE_MD(T), const Effects<T>&, DYNTAPE_V(T), DYNTAPE_V(T),    \
                                             DYNTAPE_V(T));                                                   \
  }
// clang-format on
