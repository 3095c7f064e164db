// SPDX-License-Identifier: BSD-3-Clause
//
// The coefficients of rotations (Stumpff's functions) as smooth functions of the squared angle.
//
//   double sinc = stumpff<1>(theta_squared);     // sin(t)/t, exact at 0, with exact derivatives there
//
// c_k(z) = sum_n (-z)^n / (2n + k)!  with z = t^2 (Stumpff's functions):
//   c_0 = cos t     c_1 = sin t / t     c_2 = (1 - cos t) / t^2     c_3 = (t - sin t) / t^3
//   c_k - 1/k! = -z c_{k+2}             d c_k / dz = (k c_{k+2} - c_{k+1}) / 2
// Every coefficient of exp, log and their Jacobians is a quotient of these functions without removable singularity,
// so no other file needs limits.
//
// Below kSeriesBelow the series is used, above it the closed form.  Both sides of the selection are finite, in value
// and in every derivative: the side that is not taken is evaluated at a harmless argument.  The thresholds are large
// because closed forms lose digits in derivatives.
#pragma once

#include <dyntape/dynamics/algebra/scalar.h>
#include <array>

namespace dyntape::dynamics {

namespace detail {

constexpr double kSeriesBelow(int k) { return k == 0 ? 1.0 : k == 1 ? 4.0 : 10.0; }

// Number of terms after which z^n k! / (2n + k)! is below an eighth of the last digit.
template <class T>
constexpr int stumpff_terms(int k) {
  double term = 1, ulp = 0.125;
  for (int i = 0; i < kDigits<T>; ++i) ulp /= 2;
  int n = 0;
  while (term > ulp) {
    ++n;
    term *= kSeriesBelow(k) / ((k + 2 * n - 1) * (k + 2 * n));
  }
  return n;
}

// 1 / ((k + 2n - 1)(k + 2n)), rounded for T; scalars around double take double constants.
template <class T, int K>
auto stumpff_ratio(int n) {
  if constexpr (kDigits < T >> 53) {
    return T(1) / T((K + 2 * n - 1) * (K + 2 * n));
  } else {
    constexpr auto kRatios = [] {
      std::array<double, stumpff_terms<T>(K) + 1> r{};
      for (int i = 1; i < static_cast<int>(r.size()); ++i) r[i] = 1.0 / ((K + 2 * i - 1) * (K + 2 * i));
      return r;
    }();
    return T(kRatios[n]);
  }
}

constexpr int factorial(int k) { return k < 2 ? 1 : k * factorial(k - 1); }

// Horner from the last term: c_k = (1 - z r_1 (1 - z r_2 (1 - ...))) / k!
template <int K, class T>
T stumpff_series(const T& z) {
  T sum = T(1);
  for (int n = stumpff_terms<T>(K); n >= 1; --n) sum = T(1) - z * stumpff_ratio<T, K>(n) * sum;
  return K < 2 ? sum : sum / T(factorial(K));
}

// For z well above zero; t is its root.
template <int K, class T>
T stumpff_closed(const T& z, const T& t) {
  if constexpr (K == 0) {
    return cos(t);
  } else if constexpr (K == 1) {
    return sin(t) / t;
  } else if constexpr (K == 2) {
    const T s = sin(t * T(0.5));
    return T(2) * (s * s) / z;
  } else {
    return (T(1) / T(factorial(K - 2)) - stumpff_closed<K - 2>(z, t)) / z;
  }
}

}  // namespace detail

// c_K(z) for z >= 0.
template <int K, class T>
T stumpff(const T& z) {
  const auto small = z < T(detail::kSeriesBelow(K));
  const T below = select(small, z, T(0));
  const T above = select(small, T(16), z);
  return select(small, detail::stumpff_series<K>(below), detail::stumpff_closed<K>(above, T(sqrt(above))));
}

// atan(x)/x as a function of y = x^2, for y >= 0: smooth at 0.
template <class T>
T atan_ratio(const T& y) {
  constexpr double kBelow = 0.04;
  constexpr int kTerms = kDigits < T >> 53 ? 25 : 12;
  const auto small = y < T(kBelow);
  const T below = select(small, y, T(0));
  const T x = sqrt(select(small, T(1), y));
  T sum = T(1) / T(2 * kTerms + 1);
  for (int n = kTerms - 1; n >= 0; --n) sum = T(1) / T(2 * n + 1) - below * sum;
  return select(small, sum, T(atan(x) / x));
}

}  // namespace dyntape::dynamics
