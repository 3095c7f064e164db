// SPDX-License-Identifier: BSD-3-Clause
//
// What travels up and down a tree for every column of the motion subspace: kept quantity by quantity, `stride`
// apart, the columns of a subtree side by side (Tree::begin, end), so that one instruction serves several.
#pragma once

#include <dyntape/dynamics/data.h>
#include <dyntape/dynamics/detail/lanes.hxx>

namespace dyntape::dynamics::detail {

template <class T>
void put(T* quantity, std::ptrdiff_t stride, int place, const Vector3<T>& v) {
  for (int k = 0; k < 3; ++k) put_lane(quantity + k * stride, place, v.at(k));
}
template <class T, class Spatial>
void put_spatial(T* quantity, std::ptrdiff_t stride, int place, const Spatial& x) {
  put(quantity, stride, place, x.linear);
  put(quantity + 3 * stride, stride, place, x.angular);
}

// row[s] = axis . (three quantities at x), or with kAdd, is increased by it; columns s in [begin, end).
template <bool kAdd = false, class T>
void dot_columns(const Axis& axis, const T* x, std::ptrdiff_t stride, int begin, int end, T* row) {
  const auto result = [&](auto along) {
    over<T>(begin, end, [&](int s, auto lanes) {
      const typename Lanes<T>::Vector d = along(s, lanes);
      lanes.store(row + s, kAdd ? typename Lanes<T>::Vector(lanes.load(row + s) + d) : d);
    });
  };
  if (axis.index >= 0) {
    const T* entry = x + axis.index * stride;
    if (axis.flipped) {
      result([&](int s, auto lanes) { return -lanes.load(entry + s); });
    } else {
      result([&](int s, auto lanes) { return lanes.load(entry + s); });
    }
    return;
  }
  const Vector3<T> a = vector<T>(axis);
  result([&](int s, auto lanes) {
    return lanes.load(x + s) * a.at(0) + lanes.load(x + s + stride) * a.at(1) +
           lanes.load(x + s + 2 * stride) * a.at(2);
  });
}

// row[s] = S . F_s, six quantities at F: linear, then angular.
template <class T>
void dot_columns(const Dof& S, const T* F, std::ptrdiff_t stride, int begin, int end, T* row) {
  dot_columns(S.axis, S.angular ? F + 3 * stride : F, stride, begin, end, row);
  if (S.pitch == 0) return;
  const Vector3<T> a = motion<T>(S).linear;
  over<T>(begin, end, [&](int s, auto lanes) {
    lanes.store(row + s,
                lanes.load(row + s) + (lanes.load(F + s) * a.at(0) + lanes.load(F + s + stride) * a.at(1) +
                                       lanes.load(F + s + 2 * stride) * a.at(2)));
  });
}

// row[s] = a . m_s, six quantities at m.
template <class T, class Spatial>
void dot_columns(const Spatial& a, const T* m, std::ptrdiff_t stride, int begin, int end, T* row) {
  const Vector3<T>&l = a.linear, &w = a.angular;
  over<T>(begin, end, [&](int s, auto lanes) {
    const auto at = [&](int k) { return lanes.load(m + s + k * stride); };
    lanes.store(row + s, (at(0) * l.at(0) + at(1) * l.at(1) + at(2) * l.at(2)) +
                             (at(3) * w.at(0) + at(4) * w.at(1) + at(5) * w.at(2)));
  });
}

// m_s += S row[s].
template <class T>
void add_along_columns(const Dof& S, const T* row, T* m, std::ptrdiff_t stride, int begin, int end) {
  const auto add = [&](T* x, double scale) {
    for (int k = 0; k < 3; ++k) {
      const double a = S.axis.direction[k] * scale;
      if (a == 0) continue;
      T* along = x + k * stride;
      over<T>(begin, end, [&](int s, auto lanes) {
        const auto r = lanes.load(row + s), x = lanes.load(along + s);
        if (a == 1) {
          lanes.store(along + s, x + r);
        } else if (a == -1) {
          lanes.store(along + s, x - r);
        } else {
          lanes.store(along + s, x + r * T(a));
        }
      });
    }
  };
  add(S.angular ? m + 3 * stride : m, 1);
  if (S.pitch != 0) add(m, S.pitch);
}

// Three quantities turned: x_s <- R x_s.
template <class T>
void rotate_columns(const Matrix3<T>& R, T* x, std::ptrdiff_t stride, int begin, int end) {
  over_before<T>(begin, end, [&](int s, auto lanes) {
    const auto a = lanes.load(x + s), b = lanes.load(x + s + stride), c = lanes.load(x + s + 2 * stride);
    for (int k = 0; k < 3; ++k) {
      lanes.store(x + s + k * stride, a * R.at(k, 0) + b * R.at(k, 1) + c * R.at(k, 2));
    }
  });
}

// Forces seen from the parent: F_s <- act(X_PB, F_s).
template <class T>
void act_columns(const Placement<T>& X_PB, T* F, std::ptrdiff_t stride, int begin, int end) {
  using Vector = typename Lanes<T>::Vector;
  const Matrix3<T>& R = X_PB.R;
  const Vector3<T>& p = X_PB.p;
  over_before<T>(begin, end, [&](int s, auto lanes) {
    T* f = F + s;
    const auto row = [&](int k, const Vector& a, const Vector& b, const Vector& c) -> Vector {
      return a * R.at(k, 0) + b * R.at(k, 1) + c * R.at(k, 2);
    };
    const Vector a = lanes.load(f), b = lanes.load(f + stride), c = lanes.load(f + 2 * stride);
    const Vector f0 = row(0, a, b, c), f1 = row(1, a, b, c), f2 = row(2, a, b, c);
    const Vector d = lanes.load(f + 3 * stride), e = lanes.load(f + 4 * stride),
                 g = lanes.load(f + 5 * stride);
    lanes.store(f, f0);
    lanes.store(f + stride, f1);
    lanes.store(f + 2 * stride, f2);
    lanes.store(f + 3 * stride, row(0, d, e, g) + (f2 * p.at(1) - f1 * p.at(2)));
    lanes.store(f + 4 * stride, row(1, d, e, g) + (f0 * p.at(2) - f2 * p.at(0)));
    lanes.store(f + 5 * stride, row(2, d, e, g) + (f1 * p.at(0) - f0 * p.at(1)));
  });
}

// Motions of the parent seen from the body: m_s = act_inverse(X_PB, from_s).
template <class T>
void act_inverse_columns(const Placement<T>& X_PB, const T* from, T* to, std::ptrdiff_t stride, int begin,
                         int end) {
  using Vector = typename Lanes<T>::Vector;
  const Matrix3<T>& R = X_PB.R;
  const Vector3<T>& p = X_PB.p;
  over<T>(begin, end, [&](int s, auto lanes) {
    const auto at = [&](int k) -> Vector { return lanes.load(from + s + k * stride); };
    const auto row = [&](int k, const Vector& a, const Vector& b, const Vector& c) -> Vector {
      return a * R.at(0, k) + b * R.at(1, k) + c * R.at(2, k);
    };
    const Vector w0 = at(3), w1 = at(4), w2 = at(5);
    const Vector l0 = at(0) - (w2 * p.at(1) - w1 * p.at(2)), l1 = at(1) - (w0 * p.at(2) - w2 * p.at(0)),
                 l2 = at(2) - (w1 * p.at(0) - w0 * p.at(1));
    for (int k = 0; k < 3; ++k) {
      lanes.store(to + s + k * stride, row(k, l0, l1, l2));
      lanes.store(to + s + (k + 3) * stride, row(k, w0, w1, w2));
    }
  });
}

}  // namespace dyntape::dynamics::detail
