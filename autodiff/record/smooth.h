// SPDX-License-Identifier: BSD-3-Clause
//
// Norms and quotients with finite slopes of all orders everywhere, for any scalar.  Use them if a length or a divisor
// may be zero, such as at the start of a solve.
//
//   AD length = norm(v, 1e-6);                 // sqrt(v . v + smoothing^2)
//   AD ratio = safe_divide(a, b, 1e-6);        // a b / (b^2 + smoothing^2)
//
// Parameters: smoothing > 0, in the unit of v and of b.
// Errors of the results:
//   norm          too long by smoothing at v = 0, and by smoothing^2 / (2 |v|) far from zero
//   safe_divide   0 at b = 0; far from zero, a / b with a relative error of (smoothing / b)^2
// ArgumentError: smoothing is not a finite number > 0.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <type_traits>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/eigen.h>

namespace dyntape {

namespace detail {
inline void check_smoothing(double smoothing, const std::string& function) {
  if (smoothing > 0 && std::isfinite(smoothing)) return;
  throw ArgumentError(function + ": smoothing: got " + std::to_string(smoothing) +
                      ", expected a number greater than 0");
}
}  // namespace detail

template <class Derived>
typename Derived::Scalar norm(const Eigen::MatrixBase<Derived>& v, double smoothing) {
  using T = typename Derived::Scalar;
  using std::sqrt;
  detail::check_smoothing(smoothing, "norm");
  return sqrt(T(v.squaredNorm() + T(smoothing * smoothing)));
}

// Uses hypot, so that no square overflows.
template <class T>
T safe_divide(const T& a, const std::type_identity_t<T>& b, double smoothing) {
  using std::hypot;
  detail::check_smoothing(smoothing, "safe_divide");
  const T length = hypot(b, T(smoothing));
  return a * (b / length) / length;
}

}  // namespace dyntape
