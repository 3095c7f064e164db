// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/algorithms/detail/second_order.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_SECOND_ORDER(T)                                                                  \
  namespace dyntape::dynamics {                                                                              \
  template struct MovingBodies<T>;                                                                           \
  template struct SecondOrder<T>;                                                                            \
  template struct ForwardSecondOrder<T>;                                                                     \
  template struct Hessian<T>;                                                                                \
  template void id_second_order(DYNTAPE_MD(T), SecondOrder<T>&, DYNTAPE_V(T), DYNTAPE_V(T), DYNTAPE_V(T),    \
      const Acting<T>&);                                                                                     \
  template void fd_second_order(DYNTAPE_MD(T), ForwardSecondOrder<T>&, DYNTAPE_V(T), DYNTAPE_V(T),           \
      DYNTAPE_V(T), const Acting<T>&);                                                                       \
  template const MatrixX<T>& id_hessian(DYNTAPE_MD(T), Hessian<T>&, DYNTAPE_V(T), DYNTAPE_V(T),              \
      DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);                                                         \
  template const MatrixX<T>& fd_hessian(DYNTAPE_MD(T), Hessian<T>&, DYNTAPE_V(T), DYNTAPE_V(T),              \
      DYNTAPE_V(T), DYNTAPE_V(T), const Acting<T>&);                                                         \
  }
// clang-format on
