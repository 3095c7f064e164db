// SPDX-License-Identifier: BSD-3-Clause
//
// Viscous damping of joints: tau = - d v.
//
//   effects.damping = model_damping(model);   // the file's values
#pragma once

#include <dyntape/dynamics/effects/effect_torques.h>
#include <dyntape/dynamics/model/checks.h>

namespace dyntape::dynamics {

template <class T>
struct Damping {
  static constexpr const char* kName = "joint damping";

  VectorX<T> coefficient;  // (nv) N m s/rad or N s/m

  Damping(VectorX<T> values) : coefficient(std::move(values)) {}  // NOLINT
  template <class V>
  Damping(const Eigen::MatrixBase<V>& values) : coefficient(values) {}  // NOLINT

  template <class S>
  Damping<S> cast() const {
    return coefficient.template cast<S>();
  }
  void check(const Model<T>& model) const {
    detail::check("effects", "damping", model, coefficient.size(), model.nv);
  }
  void add_joint_torques(const Model<T>&, EffectTorques<T>& torques, const VectorRef<T>&,
                         const VectorRef<T>& v) const {
    torques.tau -= coefficient.cwiseProduct(v);
  }
  void add_joint_slopes(const Model<T>&, EffectTorques<T>& torques, const VectorRef<T>&) const {
    torques.dtau_dv -= coefficient;
  }
};

}  // namespace dyntape::dynamics
