// SPDX-License-Identifier: BSD-3-Clause
//
// Inertia without weight that moves with a body, e.g. of the water around it (effects/added_mass.h).
//
//   acting.added = view(list);            // list: a container of AddedInertia, or of a derived type
//
// At a frame F of the body, with V and A_F the velocity and acceleration of F (linear, angular, in F), without
// gravity:
//   force = -(D A_F + V x* D V),   D = diag(mass, inertia)
// This is the force of a rigid body of inertia D, except that the mass may differ between axes.  Source: H. Lamb,
// Hydrodynamics, 1932, chapter VI: Kirchhoff's equations, three planes of symmetry, water at rest.
#pragma once

#include <dyntape/dynamics/algebra/composite.h>

namespace dyntape::dynamics {

template <class T>
struct AddedInertia {
  int body = -1;  // -1: none
  Placement<T> X_BF;
  Vector3<T> mass = Vector3<T>::Zero(),
             inertia = Vector3<T>::Zero();  // kg, kg m^2, along and about the axes of F
};

// A view of a list of added inertias.
template <class T>
struct AddedInertias {
  const void* list = nullptr;
  int count = 0;
  const AddedInertia<T>& (*at)(const void* list, int i) = nullptr;
};

template <class T, class List>
AddedInertias<T> view(const List& list) {
  return {&list, static_cast<int>(list.size()), [](const void* all, int i) -> const AddedInertia<T>& {
            return (*static_cast<const List*>(all))[std::size_t(i)];
          }};
}

// The added inertia about the origin of its body.
template <class T>
Articulated<T> articulated(const AddedInertia<T>& added) {
  Articulated<T> at_frame, at_body;
  for (int k = 0; k < 3; ++k) at_frame.M(k, k) = added.mass[k], at_frame.J(k, k) = added.inertia[k];
  accumulate(added.X_BF, at_frame, at_body);
  return at_body;
}

}  // namespace dyntape::dynamics
