// SPDX-License-Identifier: BSD-3-Clause
//
// Integrates one step of length h (s), for any scalar, configuration space and rate.  Use it to record a step or to
// write an integrator; interface/system/steps has complete steppers.
//
//   const auto rate = [&](const T& s, const VectorX<T>& x) -> VectorX<T> { ... };     // x' at time t + s, (nt)
//   VectorX<T> x1 = runge_kutta_4(X, rate, h, x0);                                    // any space
//
//   const auto a = [&](const T& s, const VectorX<T>& q, const VectorX<T>& v) -> VectorX<T> { ... };   // v' (nv)
//   Phase<T> next = semi_implicit_euler(Q, a, h, {q, v});                             // q' = v, v' = a
//
//   scheme              of order   a step, m = (v + v')/2
//   runge_kutta_4       4          stages k_i = rate; on lines the classical one, elsewhere two exponentials
//   semi_implicit_euler 1          v' = v + h a(h, q, v)                      q' = q (+) h v'
//   implicit_midpoint   2          v' = v + h a(h/2, q (+) h m / 2, m)        q' = q (+) h m
//   implicit_velocity   1          v' = v + h a(h, q', v')                    q' = q (+) h v'
//
// semi_implicit_euler evaluates a at the newest values: explicit functions of time, such as motors, at the step's
// end.
//
// An implicit scheme is two functions: the residual (nv) of the change dv = v' - v, which is zero at the solution,
// and the end of the step for a given change.
//
// - implicit_midpoint is xi = h f(x (+) xi / 2), x' = x (+) xi for x = (q, v), xi = (h m, dv), with the q part
// eliminated.  On linear spaces it preserves quadratic invariants.
// - implicit_velocity damps stiff parts.
//
// Sources: E. Celledoni, A. Marthinsen, B. Owren, Commutator-free Lie group methods, FGCS 19 (2003), with exponentials
// on the right since increments are in the moving frame; E. Hairer, C. Lubich, G. Wanner, Geometric Numerical
// Integration, 2006 (I.1, II.1, IV.2).
#pragma once

#include <dyntape/dynamics/simulation/state_space.h>

namespace dyntape::dynamics {

template <class T>
struct Phase {
  VectorX<T> q, v;
};

namespace detail {

// Writes x + d for the lines of a space, where the exponential of several increments is their sum.
template <class T>
void add_on_lines(const std::vector<Line>& lines, const VectorX<T>& x, const VectorX<T>& d, VectorX<T>& sum) {
  for (const Line& line : lines) sum[line.x] = x[line.x] + d[line.t];
}

}  // namespace detail

template <StateSpace S, class Rate, class T = typename S::Scalar>
VectorX<T> runge_kutta_4(const S& space, const Rate& rate, const std::type_identity_t<T>& h,
                         const VectorX<T>& x) {
  const std::vector<Line> lines = space.lines();
  const T half = h * T(0.5);
  const VectorX<T> k1 = rate(T(0), x);
  const VectorX<T> x2 = space.integrate(x, VectorX<T>(k1 * half));
  const VectorX<T> k2 = rate(half, x2);
  const VectorX<T> k3 = rate(half, space.integrate(x, VectorX<T>(k2 * half)));
  VectorX<T> x4 = space.integrate(x2, VectorX<T>(k3 * h - k1 * half));
  detail::add_on_lines<T>(lines, x, k3 * h, x4);
  const VectorX<T> k4 = rate(h, x4);
  const VectorX<T> middle = (k2 + k3) * T(2);
  const T twelfth = h / T(12);
  const VectorX<T> halfway = space.integrate(x, VectorX<T>((k1 * T(3) + middle - k4) * twelfth));
  VectorX<T> end = space.integrate(halfway, VectorX<T>((k4 * T(3) + middle - k1) * twelfth));
  detail::add_on_lines<T>(lines, x, (k1 + middle + k4) * (h / T(6)), end);
  return end;
}

template <StateSpace Q, class Acceleration, class T = typename Q::Scalar>
Phase<T> semi_implicit_euler(const Q& space, const Acceleration& a, const std::type_identity_t<T>& h,
                             const Phase<T>& x) {
  const VectorX<T> v = x.v + a(h, x.q, x.v) * h;
  return {space.integrate(x.q, VectorX<T>(v * h)), v};
}

template <StateSpace Q, class Acceleration, class T = typename Q::Scalar>
VectorX<T> implicit_midpoint_residual(const Q& space, const Acceleration& a, const std::type_identity_t<T>& h,
                                      const Phase<T>& x, const VectorX<T>& dv) {
  const T half = h * T(0.5);
  const VectorX<T> m = x.v + dv * T(0.5);
  return dv - a(half, space.integrate(x.q, VectorX<T>(m * half)), m) * h;
}

template <StateSpace Q, class T = typename Q::Scalar>
Phase<T> implicit_midpoint_end(const Q& space, const std::type_identity_t<T>& h, const Phase<T>& x,
                               const VectorX<T>& dv) {
  const VectorX<T> m = x.v + dv * T(0.5);
  return {space.integrate(x.q, VectorX<T>(m * h)), x.v + dv};
}

template <StateSpace Q, class T = typename Q::Scalar>
Phase<T> implicit_velocity_end(const Q& space, const std::type_identity_t<T>& h, const Phase<T>& x,
                               const VectorX<T>& dv) {
  const VectorX<T> v = x.v + dv;
  return {space.integrate(x.q, VectorX<T>(v * h)), v};
}

template <StateSpace Q, class Acceleration, class T = typename Q::Scalar>
VectorX<T> implicit_velocity_residual(const Q& space, const Acceleration& a, const std::type_identity_t<T>& h,
                                      const Phase<T>& x, const VectorX<T>& dv) {
  const Phase<T> end = implicit_velocity_end(space, h, x, dv);
  return dv - a(h, end.q, end.v) * h;
}

}  // namespace dyntape::dynamics
