// SPDX-License-Identifier: BSD-3-Clause
//
// A spring and damper that only push, smoothly: for limits and slack ropes.
//
//   OneSided<T> pull = one_sided(elongation, rate, stiffness, damping, margin);   // pull.force >= 0
//
// With x beyond the onset (m or rad), u = x / margin, and the ramp r, which is 0 for u <= 0, u^3 - u^4 / 2 up to
// u = 1 and u - 1/2 from there on (its slope is the smooth step 3 u^2 - 2 u^3):
//   force = r(u) (d x' + sqrt((d x')^2 + (k margin)^2))
// At rest the force is k margin r: k (x - margin / 2) beyond the margin.  It is never negative.  The damper's part,
// force minus force at rest, has the sign of x', so it only dissipates.  Twice continuously differentiable in x,
// infinitely often in x' (k > 0).  For small rates: force = r (k margin + d x').
#pragma once

#include <dyntape/dynamics/algebra/scalar.h>

namespace dyntape::dynamics {

template <class T>
struct OneSided {
  T force, by_length, by_rate;  // N or N m; its derivatives by x and x'
};

namespace detail {

// Returns select(u <= 0, zero, select(u < 1, within, beyond)).
template <class T>
T ramp_part(const T& u, const T& within, const T& beyond) {
  return select(u > T(0), T(select(u < T(1), within, beyond)), T(0));
}

}  // namespace detail

template <class T>
OneSided<T> one_sided(const T& x, const T& rate, const T& stiffness, const T& damping, const T& margin) {
  const T u = x / margin, at_rest = stiffness * margin, speeding = damping * rate;
  const T root = sqrt(T(speeding * speeding + at_rest * at_rest)), push = speeding + root;
  const T ramp = detail::ramp_part<T>(u, u * u * u * (T(1) - T(0.5) * u), u - T(0.5));
  const T step = detail::ramp_part<T>(u, u * u * (T(3) - T(2) * u), T(1));
  return {ramp * push, step / margin * push, ramp * (damping * push / root)};
}

// The stored energy at x (J): stiffness margin^2 (u^4 / 4 - u^5 / 10), or (u^2 - u) / 2 + 3 / 20.
template <class T>
T one_sided_energy(const T& x, const T& stiffness, const T& margin) {
  const T u = x / margin, u4 = u * u * u * u;
  const T area = detail::ramp_part<T>(u, u4 * (T(0.25) - u * T(0.1)), (u * u - u) * T(0.5) + T(0.15));
  return stiffness * margin * margin * area;
}

}  // namespace dyntape::dynamics
