// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/inverse_dynamics.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_INVERSE_DYNAMICS(T)                                                              \
  namespace dyntape::dynamics {                                                                              \
  template const VectorX<T>& rnea(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const             \
      Acting<T>&);                                                                                           \
  template const VectorX<T>& nonlinear_effects(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&); \
  template const VectorX<T>& generalized_gravity(DYNTAPE_MD(T), DYNTAPE_V(T));                               \
  template const MatrixX<T>& crba(DYNTAPE_MD(T), DYNTAPE_V(T), const Acting<T>&);                            \
  template const T& kinetic_energy(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);             \
  template const T& potential_energy(DYNTAPE_MD(T), DYNTAPE_V(T));                                           \
  template const Vector3<T>& center_of_mass(DYNTAPE_MD(T), DYNTAPE_V(T));                                    \
  }
// clang-format on
