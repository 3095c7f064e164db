// SPDX-License-Identifier: BSD-3-Clause
//
// Uniform gravity: the model's (Model::gravity), or a given vector.  Always on, unless `effects.gravity = false`.
//
//   effects.gravity.vector = Vector3<double>(0, 0, -1.62);   // m/s^2, world frame: on the moon
//
// tau = - g(q), the gradient of the stored energy  E = - sum m vector . c  (J, zero at the world's origin).  Smooth.
// Derivatives are those of the recursions (R. Featherstone, Rigid Body Dynamics Algorithms, 2008: the world
// accelerates by - vector).
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/parameters.h>

namespace dyntape::dynamics {

template <class T>
struct Gravity {
  static constexpr const char *kName = "gravity", *kKey = "gravity";

  bool acts = true;
  std::optional<Vector3<T>> vector;  // instead of the model's

  Gravity() = default;
  Gravity(bool on) : acts(on) {}  // NOLINT: effects.gravity = false
  explicit operator bool() const { return acts; }
  void reset() { acts = false; }

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{"vector", "m/s^2", "acceleration of free fall, in the place of the robot's own"},
          self.vector);
  }
  void enter(DynamicsTerms<T>& acting) const {
    acting.gravity = true;
    if (vector) acting.gravity_value = &*vector;
  }
  // After forward_kinematics.
  T stored_energy(const Model<T>& model, const Data<T>& data, const VectorRef<T>&) const {
    const Vector3<T>& fall = vector ? *vector : model.gravity;
    T energy = T(0);
    for (int i = 0; i < model.njoints(); ++i) {
      const Vector3<T> c = data.X_WB[i].R * model.inertias[i].com + data.X_WB[i].p;
      energy -= model.inertias[i].mass * fall.dot(c);
    }
    return energy;
  }
};

}  // namespace dyntape::dynamics
