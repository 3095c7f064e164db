// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/forward_dynamics.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_FORWARD_DYNAMICS(T)                                                              \
  namespace dyntape::dynamics {                                                                              \
  template const VectorX<T>& aba(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&); \
  template const MatrixX<T>& minverse(DYNTAPE_MD(T), DYNTAPE_V(T), const Acting<T>&);                        \
  }
// clang-format on
