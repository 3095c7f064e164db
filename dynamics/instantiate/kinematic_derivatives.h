// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/kinematic_derivatives.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_KINEMATIC_DERIVATIVES(T)                                                         \
  namespace dyntape::dynamics {                                                                              \
  template struct KinematicDerivatives<T>;                                                                   \
  template struct KinematicHessian<T>;                                                                       \
  template const Matrix6X<T>& frame_jacobian_rate(DYNTAPE_K(T), int, ReferenceFrame);                        \
  template const Matrix6X<T>& body_jacobian_rate(DYNTAPE_K(T), int, ReferenceFrame);                         \
  template void frame_velocity_derivatives(DYNTAPE_K(T), int, ReferenceFrame);                               \
  template void body_velocity_derivatives(DYNTAPE_K(T), int, ReferenceFrame);                                \
  template void frame_acceleration_derivatives(DYNTAPE_K(T), int, ReferenceFrame);                           \
  template void body_acceleration_derivatives(DYNTAPE_K(T), int, ReferenceFrame);                            \
  template const Matrix6X<T>& frame_hessian(const Model<T>&, const Data<T>&, KinematicHessian<T>&, int,      \
      ReferenceFrame);                                                                                       \
  template const Matrix6X<T>& body_hessian(const Model<T>&, const Data<T>&, KinematicHessian<T>&, int,       \
      ReferenceFrame);                                                                                       \
  template const MatrixX<T>& frame_weighted_hessian(DYNTAPE_K(T), int, ReferenceFrame, const Force<T>&);     \
  template const MatrixX<T>& body_weighted_hessian(DYNTAPE_K(T), int, ReferenceFrame, const Force<T>&);      \
  }
// clang-format on

#define DYNTAPE_K(T) const Model<T>&, const Data<T>&, KinematicDerivatives<T>&
