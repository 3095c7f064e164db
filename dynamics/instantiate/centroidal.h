// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/centroidal.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_CENTROIDAL(T)                                                                    \
  namespace dyntape::dynamics {                                                                              \
  template const Vector3<T>& center_of_mass(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T));                    \
  template const Vector3<T>& center_of_mass(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T), DYNTAPE_V(T));      \
  template const Vector3<T>& center_of_mass(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T), DYNTAPE_V(T),       \
      DYNTAPE_V(T));                                                                                         \
  template const Matrix3X<T>& com_jacobian(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T));                     \
  template const Matrix3X<T>& subtree_com_jacobian(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T), int);        \
  template const Force<T>& centroidal_momentum(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T), DYNTAPE_V(T));   \
  template const Force<T>& centroidal_momentum_rate(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T),             \
      DYNTAPE_V(T), DYNTAPE_V(T));                                                                           \
  template const Matrix6X<T>& centroidal_matrix(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T));                \
  template const Matrix6X<T>& centroidal_matrix_rate(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T),            \
      DYNTAPE_V(T));                                                                                         \
  template void centroidal_derivatives(DYNTAPE_MD(T), Centroidal<T>&, DYNTAPE_V(T), DYNTAPE_V(T),            \
      DYNTAPE_V(T));                                                                                         \
  }
// clang-format on
