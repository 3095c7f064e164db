// SPDX-License-Identifier: BSD-3-Clause
//
// Inertia of rotors, seen through their gears: what a joint's motor adds to the diagonal of M.
//
//   effects.armature = model_armature(model);   // the file's values
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/checks.h>

namespace dyntape::dynamics {

template <class T>
struct Armature {
  static constexpr const char* kName = "armature";

  VectorX<T> inertia;  // (nv) kg m^2 or kg; of single joints, other entries are not read

  Armature(VectorX<T> values) : inertia(std::move(values)) {}  // NOLINT
  template <class V>
  Armature(const Eigen::MatrixBase<V>& values) : inertia(values) {}  // NOLINT

  template <class S>
  Armature<S> cast() const {
    return inertia.template cast<S>();
  }
  void check(const Model<T>& model) const {
    detail::check("effects", "armature", model, inertia.size(), model.nv);
  }
  // `acting` keeps a pointer to the values.
  void enter(Acting<T>& acting) const {
    acting.armature = true;
    acting.armature_values = &inertia;
  }
};

}  // namespace dyntape::dynamics
