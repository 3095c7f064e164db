// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/mimic.hxx>

#define DYNTAPE_MIMIC(T) const MimicModel<T>&, MimicData<T>&

// clang-format off
#define DYNTAPE_INSTANTIATE_MIMIC(T)                                                                         \
  namespace dyntape::dynamics {                                                                              \
  template struct MimicModel<T>;                                                                             \
  template struct MimicData<T>;                                                                              \
  template VectorX<T> expand_configuration(const MimicModel<T>&, DYNTAPE_V(T));                              \
  template VectorX<T> expand_tangent(const MimicModel<T>&, DYNTAPE_V(T));                                    \
  template VectorX<T> gather(const MimicModel<T>&, DYNTAPE_V(T));                                            \
  template MatrixX<T> gather_columns(const MimicModel<T>&, const MatrixX<T>&);                               \
  template MatrixX<T> gather_both(const MimicModel<T>&, const MatrixX<T>&);                                  \
  template const VectorX<T>& rnea(DYNTAPE_MIMIC(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const          \
      Acting<T>&);                                                                                           \
  template const VectorX<T>& nonlinear_effects(DYNTAPE_MIMIC(T), DYNTAPE_V(T), DYNTAPE_V(T), const           \
      Acting<T>&);                                                                                           \
  template const VectorX<T>& generalized_gravity(DYNTAPE_MIMIC(T), DYNTAPE_V(T));                            \
  template const MatrixX<T>& crba(DYNTAPE_MIMIC(T), DYNTAPE_V(T), const Acting<T>&);                         \
  template const VectorX<T>& aba(DYNTAPE_MIMIC(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const           \
      Acting<T>&);                                                                                           \
  template const MatrixX<T>& minverse(DYNTAPE_MIMIC(T), DYNTAPE_V(T), const Acting<T>&);                     \
  template void id_derivatives(DYNTAPE_MIMIC(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const             \
      Acting<T>&);                                                                                           \
  template void fd_derivatives(DYNTAPE_MIMIC(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const             \
      Acting<T>&);                                                                                           \
  template const T& kinetic_energy(DYNTAPE_MIMIC(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);          \
  template const T& potential_energy(DYNTAPE_MIMIC(T), DYNTAPE_V(T));                                        \
  template VectorX<T> integrate(const MimicModel<T>&, DYNTAPE_V(T), DYNTAPE_V(T));                           \
  template VectorX<T> difference(const MimicModel<T>&, DYNTAPE_V(T), DYNTAPE_V(T));                          \
  template VectorX<T> neutral(const MimicModel<T>&);                                                         \
  template VectorX<T> random_configuration(const MimicModel<T>&, std::mt19937_64&);                          \
  }
// clang-format on
