// SPDX-License-Identifier: BSD-3-Clause
//
// Functions of <cmath> that are composed of rows of ops.def, for the recording scalar, packs and jets.
//
//   fdim(x, y)       x - y if x > y, else 0; NaN if an argument is NaN.  The slope at a tie is 0
//   hypot(x, y, z)   the norm of three numbers without intermediate overflow; infinite if an argument is infinite.
//                    At the origin value and slopes are 0.  Second derivatives are correct on the axes; those of
//                    hypot(hypot(x, y), z) are not, since it has no curvature at x = y = 0
#pragma once

#include <limits>

namespace dyntape::ops {

template <class T>
T positive_difference(const T& x, const T& y) {
  return select(x <= y, T(0), x - y);
}

// sqrt(x^2 + y^2 + z^2), scaled by powers of two, which change no digit.
template <class T>
T length_of_three(const T& x, const T& y, const T& z) {
  const T a = abs(x), b = abs(y), c = abs(z), largest = max(max(a, b), c);
  const T unit =
      select(largest > T(0x1p500), T(0x1p-600), T(select(largest < T(0x1p-500), T(0x1p600), T(1))));
  const T u = x * unit, v = y * unit, w = z * unit, squares = u * u + v * v + w * w;
  const T length = select(squares == T(0), T(0), T(sqrt(squares) / unit));
  const T infinite(std::numeric_limits<double>::infinity());
  return select(a == infinite || b == infinite || c == infinite, infinite, length);
}

}  // namespace dyntape::ops
