// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/model/detail/configuration.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_CONFIGURATION(T)                                                                 \
  namespace dyntape::dynamics {                                                                              \
  template VectorX<T> integrate(const Model<T>&, DYNTAPE_V(T), DYNTAPE_V(T));                                \
  template VectorX<T> difference(const Model<T>&, DYNTAPE_V(T), DYNTAPE_V(T));                               \
  template TangentJacobians<T> integrate_jacobians(const Model<T>&, DYNTAPE_V(T));                           \
  template TangentJacobians<T> difference_jacobians(const Model<T>&, DYNTAPE_V(T));                          \
  template VectorX<T> neutral(const Model<T>&);                                                              \
  template VectorX<T> random_configuration(const Model<T>&, std::mt19937_64&);                               \
  }
// clang-format on
