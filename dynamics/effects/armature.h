// SPDX-License-Identifier: BSD-3-Clause
//
// Reflected inertia of the motors' rotors, on the diagonal of the joint-space inertia.
//
//   effects.armature = model_armature(model);   // the file's values
//   effects.armature->rotor_inertia = I, effects.armature->gear_ratio = n;
//
//   M <- M + diag(inertia + n^2 I)              kg m^2 or kg; I (kg m^2) turns n times as fast as its joint
// Energy: part of the kinetic energy; neither supplied nor dissipated.  Smooth.  Source: J. Craig, Introduction to
// Robotics (reflected inertia).
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/parameters.h>

namespace dyntape::dynamics {

template <class T>
struct Armature {
  static constexpr const char *kName = "armature", *kKey = "armature";

  VectorX<T> inertia;  // (nv) kg m^2 or kg; for single joints, other entries are ignored
  std::optional<VectorX<T>> rotor_inertia, gear_ratio;  // (nv) both or neither

  Armature() = default;
  Armature(VectorX<T> values) : inertia(std::move(values)) {}  // NOLINT
  template <class V>
  Armature(const Eigen::MatrixBase<V>& values) : inertia(values) {}  // NOLINT

  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "inertia",
                        .unit = "kg m^2 or kg",
                        .what = "inertia of the motors, as felt at the joints",
                        .least = 0,
                        .fallback = 0,
                        .of_robot = model_armature<double>},
          self.inertia);
    visit(ParameterInfo{.name = "rotor_inertia",
                        .unit = "kg m^2",
                        .what = "inertia of the rotors about their own axes; needs gear_ratio",
                        .least = 0},
          self.rotor_inertia);
    visit(
        ParameterInfo{.name = "gear_ratio", .unit = "1", .what = "turns of the rotor per turn of the joint"},
        self.gear_ratio);
  }
  const char* missing() const {
    if (rotor_inertia.has_value() == gear_ratio.has_value()) return nullptr;
    return rotor_inertia ? "gear_ratio" : "rotor_inertia";
  }
  // `acting` holds pointers to the values.
  void enter(DynamicsTerms<T>& acting) const {
    acting.armature = true;
    acting.armature_values = &inertia;
    if (rotor_inertia && gear_ratio) acting.rotor_inertia = &*rotor_inertia, acting.gear_ratio = &*gear_ratio;
  }
};

}  // namespace dyntape::dynamics
