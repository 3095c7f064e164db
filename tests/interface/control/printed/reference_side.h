// SPDX-License-Identifier: BSD-3-Clause
//
// A side of a limit in the interior-point method of controller_reference.h.
#pragma once

namespace dyntape::test {

template <class T>
struct ReferenceConstants {
  T price, mu_cold = price, mu_warm = T(1e-3), mu_end, left, least_pivot = T(1e-20), small = T(1e-10),
           largest_price = T(1e3) * price, rounding, tolerance, damping, shortest = T(0.2), give = T(1e-8);
  int iterations, interior_steps, trials;
};

template <class T>
bool is_finite(T a) {
  return a - a == T(0);
}
template <class T>
T larger(T a, T b) {
  return a > b ? a : b;
}
template <class T>
T smaller(T a, T b) {
  return a < b ? a : b;
}
template <class T>
T size(T a) {
  return a < T(0) ? -a : a;
}
template <class T>
T excess(T a) {
  return a < T(0) ? -a : T(0);
}

template <class T>
struct ReferenceSide {
  using Constants = ReferenceConstants<T>;

  // Slack, multiplier, excess and its multiplier; value, weight, and the aims.
  T t = T(0), l = T(0), s = T(0), n = T(0), b = T(0), w = T(0), aim_t = T(0), aim_s = T(0);
  struct {
    T t = T(0), l = T(0), s = T(0);
  } d;  // changes

  void begin(const Constants& k, T value, T mu, bool soft) {
    const T before = larger(l, mu);
    b = value, t = larger(b, mu / before), l = mu / t, s = T(0), n = k.price;
    if (!soft) return;
    l = smaller(l, T(0.5) * k.price), n = k.price - l, s = mu / n;
    if (!(-b > s)) return;
    s = -b, n = smaller(mu / s, T(0.5) * k.price), l = k.price - n, t = mu / l;
  }

  void change(T v, bool soft) {
    d.l = -(w * (v + aim_s - aim_t));
    d.t = aim_t - t / l * d.l - t;
    d.s = soft ? aim_s + s / n * d.l - s : T(0);
  }

  // `most`: the part of the way to the boundary.
  static T part_of(T most, T part, T v, T change) {
    return -most * v > part * change ? -most * v / change : part;
  }
};

}  // namespace dyntape::test
