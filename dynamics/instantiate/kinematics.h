// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/kinematics.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_KINEMATICS(T)                                                                    \
  namespace dyntape::dynamics {                                                                              \
  template void forward_kinematics(DYNTAPE_MD(T), DYNTAPE_V(T));                                             \
  template void forward_kinematics(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T));                               \
  template void forward_kinematics(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T));                 \
  template Placement<T> frame_placement(const Model<T>&, const Data<T>&, int);                               \
  template Motion<T> frame_velocity(const Model<T>&, const Data<T>&, int, ReferenceFrame);                   \
  template Motion<T> frame_acceleration(const Model<T>&, const Data<T>&, int, ReferenceFrame);               \
  template Motion<T> frame_classical_acceleration(const Model<T>&, const Data<T>&, int, ReferenceFrame);     \
  template const Matrix6X<T>& frame_jacobian(DYNTAPE_MD(T), DYNTAPE_V(T), int, ReferenceFrame);              \
  template const Matrix6X<T>& body_jacobian(DYNTAPE_MD(T), DYNTAPE_V(T), int, ReferenceFrame);               \
  }
// clang-format on
