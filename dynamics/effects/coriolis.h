// SPDX-License-Identifier: BSD-3-Clause
//
// Velocity products C(q, v) v: Coriolis, centrifugal and gyroscopic terms.  Always on, unless `effects.coriolis =
// false`, for linear studies.  Then velocities are zero in the recursions, and these terms add nothing to a tape.
// Damping, contacts and all other effects still use v.
//
// Energy: neither stored nor dissipated, since v . C v = v . (dM/dt) v / 2.  Without them the energy balance shows
// the missing part.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/effects/parameters.h>

namespace dyntape::dynamics {

template <class T>
struct Coriolis {
  static constexpr const char *kName = "velocity products", *kKey = "coriolis";

  bool acts = true;

  Coriolis() = default;
  Coriolis(bool on) : acts(on) {}  // NOLINT: effects.coriolis = false
  explicit operator bool() const { return acts; }
  void reset() { acts = false; }

  template <class Self, class Visit>
  static void visit_parameters(Self&, Visit&&) {}
  void enter(DynamicsTerms<T>& acting) const { acting.coriolis = true; }
};

}  // namespace dyntape::dynamics
