// SPDX-License-Identifier: BSD-3-Clause
//
// Added mass of water around a body: inertia without weight, which may differ between axes.
//
//   AddedBody<double> hull;
//   place_at_frame(model, "hull_centre", hull);
//   hull.mass = {5, 60, 60};                        // kg: small along x, large across
//   effects.added_mass.push_back(hull);
//
//   F = -(D A + V x* D V),  D = diag(mass, inertia), in the axes of the frame         (algorithms/added_inertia.h)
// Energy: part of the kinetic energy; neither supplied nor dissipated.  Smooth.  The water is at rest, also if drag
// is relative to a current.  A sphere of radius r has (2/3) pi rho r^3 along each axis, a long cylinder pi rho r^2
// per length across (H. Lamb, Hydrodynamics, 1932, 92 and 68).
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/parameters.h>

namespace dyntape::dynamics {

template <class T>
struct AddedBody : AddedInertia<T> {
  template <class Self, class Visit>
  static void visit_parameters(Self& self, Visit&& visit) {
    visit(ParameterInfo{.name = "mass",
                        .unit = "kg",
                        .what = "added mass along each axis of the frame",
                        .least = 0,
                        .fallback = 0},
          self.mass);
    visit(ParameterInfo{.name = "inertia",
                        .unit = "kg m^2",
                        .what = "added inertia about each axis of the frame",
                        .least = 0,
                        .fallback = 0},
          self.inertia);
  }
};

template <class T>
struct AddedMass : EffectList<AddedBody<T>> {
  static constexpr const char *kName = "added mass", *kKey = "added_mass", *kItem = "body";
  using EffectList<AddedBody<T>>::EffectList;

  template <class Self, class Visit>
  static void visit_parameters(Self&, Visit&&) {}
  // `acting` holds a pointer to the list.
  void enter(DynamicsTerms<T>& acting) const { acting.added = view<T>(*this); }
};

}  // namespace dyntape::dynamics
