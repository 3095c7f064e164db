// SPDX-License-Identifier: BSD-3-Clause
//
// Gravity, as the model has it (Model::gravity); chosen unless `effects.gravity = false`.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape::dynamics {

struct Gravity {
  static constexpr const char* kName = "gravity";

  bool acts = true;

  Gravity() = default;
  Gravity(bool on) : acts(on) {}  // NOLINT: effects.gravity = false
  explicit operator bool() const { return acts; }
  void reset() { acts = false; }

  template <class S>
  Gravity cast() const {
    return *this;
  }
  template <class T>
  void check(const Model<T>&) const {}
  template <class T>
  void enter(Acting<T>& acting) const {
    acting.gravity = true;
  }
};

}  // namespace dyntape::dynamics
