// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/dynamics/instantiate/shorthands.h>
#include <dyntape/dynamics/effects/detail/wrenches.hxx>

// clang-format off
#define DYNTAPE_INSTANTIATE_WRENCHES(T)                                                                      \
  namespace dyntape::dynamics {                                                                              \
  template Wrench<T> wrench_at_frame(const Model<T>&, int, FixedIn, const std::type_identity_t<Force<T>>&);  \
  template const VectorX<T>& wrench_torques(DYNTAPE_MD(T), WrenchTorques<T>&, const std::vector<Wrench<T>>&, \
      DYNTAPE_V(T));                                                                                         \
  template const MatrixX<T>& wrench_torque_derivatives(DYNTAPE_MD(T), WrenchTorques<T>&,                     \
      const std::vector<Wrench<T>>&, DYNTAPE_V(T));                                                          \
  }
// clang-format on
