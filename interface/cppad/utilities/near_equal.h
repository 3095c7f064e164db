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
inline bool near_equal(long double x, long double y, long double r, long double a) {
  if (!std::isfinite(x) || !std::isfinite(y)) return false;
  const long double apart = std::abs(x - y);
  return apart <= a || apart <= r * (std::abs(x) + std::abs(y));
}
}  // namespace detail

// Of std::complex: the real and the imaginary parts.
template <class X, class Y, class R, class A>
requires requires(X x, Y y) { plain_value(x), plain_value(y); }
bool NearEqual(const X& x, const Y& y, const R& r, const A& a) {
  const auto u = plain_value(x);
  const auto v = plain_value(y);
  const auto relative = std::real(plain_value(r)), absolute = std::real(plain_value(a));
  return detail::near_equal(std::real(u), std::real(v), relative, absolute) &&
         detail::near_equal(std::imag(u), std::imag(v), relative, absolute);
}
// Of a base of the user, which has <=.
template <class X>
requires(!requires(X x) { plain_value(x); }) bool NearEqual(const X& x, const X& y, const X& r, const X& a) {
  const X zero(0);
  const auto size = [&](const X& v) { return v <= zero ? X(-v) : v; };
  const X apart = size(x - y);
  return apart <= a || apart <= r * (size(x) + size(y));
}

}  // namespace CppAD::inline dyntape_names
