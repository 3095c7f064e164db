// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/derivatives.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_DERIVATIVES(T)                                                                   \
  namespace dyntape::dynamics {                                                                              \
  template void id_derivatives(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);   \
  template void id_derivatives_under(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T),                \
                                     const Acting<T>&);                                                      \
  template void fd_derivatives(DYNTAPE_MD(T), DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);   \
  }
// clang-format on
