// SPDX-License-Identifier: BSD-3-Clause
//
// Checks whether two numbers are equal up to rounding.
//
//   NearEqual(x, y, r, a)      // |x - y| <= a, or |x - y| <= r (|x| + |y|); false for NaN and infinity
#pragma once

#include <cmath>
#include <complex>

#include <dyntape/interface/cppad/conditions.h>

namespace CppAD::inline dyntape_names {

namespace detail {
inline bool near_equal(double x, double y, double r, double a) {
  if (!std::isfinite(x) || !std::isfinite(y)) return false;
  const double apart = std::abs(x - y);
  return apart <= a || apart <= r * (std::abs(x) + std::abs(y));
}
}  // namespace detail

template <class X, class Y, class R, class A>
requires requires(X x, Y y) { plain_value(x), plain_value(y); }
bool NearEqual(const X& x, const Y& y, const R& r, const A& a) {
  return detail::near_equal(double(plain_value(x)), double(plain_value(y)), double(plain_value(r)),
                            double(plain_value(a)));
}
// Of std::complex, and of one beside a number.
template <class X, class Y, class R, class A>
requires(
    requires(X z) { z.real(), z.imag(); } ||
    requires(Y z) { z.real(), z.imag(); }) bool NearEqual(const X& x, const Y& y, const R& r, const A& a) {
  using std::imag, std::real;
  return detail::near_equal(double(real(x)), double(real(y)), double(r), double(a)) &&
         detail::near_equal(double(imag(x)), double(imag(y)), double(r), double(a));
}

}  // namespace CppAD::inline dyntape_names
