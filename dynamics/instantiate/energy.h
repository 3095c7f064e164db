// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/energy.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_ENERGY(T)                                                                        \
  namespace dyntape::dynamics {                                                                              \
  template void kinetic_energy_gradients(DYNTAPE_MD(T), EnergyGradients<T>&, DYNTAPE_V(T), DYNTAPE_V(T),     \
      const Acting<T>&);                                                                                     \
  template const MatrixX<T>& gravity_derivatives(DYNTAPE_MD(T), EnergyGradients<T>&, DYNTAPE_V(T));          \
  template void nonlinear_effects_derivatives(DYNTAPE_MD(T), EnergyGradients<T>&, DYNTAPE_V(T),              \
      DYNTAPE_V(T), const Acting<T>&);                                                                       \
  }
// clang-format on
