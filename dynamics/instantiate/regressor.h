// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/regressor.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_REGRESSOR(T)                                                                     \
  namespace dyntape::dynamics {                                                                              \
  template Vector10<T> inertial_parameters(const Inertia<T>&);                                               \
  template Inertia<T> inertia_from(const Vector10<T>&);                                                      \
  template VectorX<T> inertial_parameters(const Model<T>&);                                                  \
  template void set_inertial_parameters(Model<T>&, DYNTAPE_V(T));                                            \
  template struct RegressorData<T>;                                                                          \
  template const MatrixX<T>& torque_regressor(DYNTAPE_MD(T), RegressorData<T>&, DYNTAPE_V(T), DYNTAPE_V(T),  \
      DYNTAPE_V(T));                                                                                         \
  template const RowVectorX<T>& kinetic_energy_regressor(DYNTAPE_MD(T), RegressorData<T>&, DYNTAPE_V(T),     \
      DYNTAPE_V(T));                                                                                         \
  template const RowVectorX<T>& potential_energy_regressor(DYNTAPE_MD(T), RegressorData<T>&, DYNTAPE_V(T));  \
  }
// clang-format on
