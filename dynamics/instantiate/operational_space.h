// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/operational_space.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_OPERATIONAL_SPACE(T)                                                             \
  namespace dyntape::dynamics {                                                                              \
  template struct OperationalSpace<T>;                                                                       \
  template void operational_space(DYNTAPE_MD(T), OperationalSpace<T>&, DYNTAPE_V(T), DYNTAPE_V(T), int,      \
      ReferenceFrame, const OperationalOptions&, const Acting<T>&);                                          \
  template const VectorX<T>& operational_torque(DYNTAPE_MD(T), OperationalSpace<T>&, DYNTAPE_V(T),           \
      DYNTAPE_V(T), DYNTAPE_V(T), const VectorX<T>*, const Acting<T>&);                                      \
  template const VectorX<T>& operational_bias(DYNTAPE_MD(T), OperationalSpace<T>&, DYNTAPE_V(T),             \
      DYNTAPE_V(T), const Acting<T>&);                                                                       \
  }
// clang-format on
