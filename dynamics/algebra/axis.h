// SPDX-License-Identifier: BSD-3-Clause
//
// A constant unit direction whose structure (coordinate axis or general) is known before any algorithm runs.
//
//   Axis axis = Axis::from(Eigen::Vector3d::UnitZ());
//   dot(axis, x);            // x[2], instead of three products with two zeros
//
// Most joints turn about a coordinate axis.  The structure is decided here on plain doubles, so no branch and no
// product with zero reaches a recording or costs time.
#pragma once

#include <dyntape/dynamics/algebra/spatial.h>

namespace dyntape::dynamics {

struct Axis {
  int index = 2;         // 0, 1, 2: the coordinate axis; -1: a general direction
  bool flipped = false;  // true: the negative coordinate axis
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();

  static Axis from(const Eigen::Vector3d& a) {
    for (int k = 0; k < 3; ++k) {
      if (a[(k + 1) % 3] == 0 && a[(k + 2) % 3] == 0 && (a[k] == 1 || a[k] == -1)) return {k, a[k] < 0, a};
    }
    return {-1, false, a};
  }
};

template <class T>
DYNTAPE_INLINE Vector3<T> vector(const Axis& axis) {
  return axis.direction.template cast<T>();
}

template <class T>
DYNTAPE_INLINE T dot(const Axis& axis, const Vector3<T>& x) {
  if (axis.index < 0) return vector<T>(axis).dot(x);
  return axis.flipped ? T(-x[axis.index]) : x[axis.index];
}

// x x axis.
template <class T>
DYNTAPE_INLINE Vector3<T> cross(const Vector3<T>& x, const Axis& axis) {
  if (axis.index < 0) return x.cross(vector<T>(axis));
  const int k = axis.index, i = (k + 1) % 3, j = (k + 2) % 3;
  Vector3<T> y;
  y[k] = T(0);
  y[i] = axis.flipped ? T(-x[j]) : x[j];
  y[j] = axis.flipped ? x[i] : T(-x[i]);
  return y;
}

// x += axis s.
template <class T>
DYNTAPE_INLINE void add_along(const Axis& axis, const T& s, Vector3<T>& x) {
  if (axis.index < 0) {
    x += vector<T>(axis) * s;
  } else if (axis.flipped) {
    x[axis.index] -= s;
  } else {
    x[axis.index] += s;
  }
}

// A axis, for a square A.
template <class T>
DYNTAPE_INLINE Vector3<T> times(const Matrix3<T>& A, const Axis& axis) {
  if (axis.index < 0) return A * vector<T>(axis);
  const Vector3<T> column = A.column(axis.index);
  return axis.flipped ? Vector3<T>(-column) : column;
}

// R times the rotation by an angle about the axis, given its cosine and sine (Rodrigues' formula
// c 1 + s [a]x + (1 - c) a a^T; about a coordinate axis only two columns change).
template <class T>
DYNTAPE_INLINE Matrix3<T> rotate_about(const Matrix3<T>& R, const Axis& axis, const T& c, const T& s) {
  if (axis.index < 0) {
    const Vector3<T> a = vector<T>(axis);
    Matrix3<T> J = skew(a) * s + outer(a, a) * T(T(1) - c);
    for (int k = 0; k < 3; ++k) J(k, k) += c;
    return R * J;
  }
  const int k = axis.index, i = (k + 1) % 3, j = (k + 2) % 3;
  Matrix3<T> Q;
  Q.set_column(k, R.column(k));
  const Vector3<T> u = R.column(i), v = R.column(j);
  if (axis.flipped) {
    Q.set_column(i, u * c - v * s);
    Q.set_column(j, v * c + u * s);
  } else {
    Q.set_column(i, u * c + v * s);
    Q.set_column(j, v * c - u * s);
  }
  return Q;
}

// One column S of a joint's motion subspace, in the moving frame: a unit translation (axis; 0), a unit rotation (0;
// axis) or a screw (pitch axis; axis).  S is constant there for every joint type, so the bias acceleration is v x S
// qd.
struct Dof {
  int joint = -1;
  bool angular = true;
  Axis axis;
  double pitch = 0;  // of an angular column, m/rad
};

template <class T>
DYNTAPE_INLINE Motion<T> motion(const Dof& S) {
  Motion<T> m;
  (S.angular ? m.angular : m.linear) = vector<T>(S.axis);
  if (S.pitch != 0) m.linear = m.angular * T(S.pitch);
  return m;
}

template <class T>
DYNTAPE_INLINE T dot(const Dof& S, const Force<T>& f) {
  const T along = dot(S.axis, S.angular ? f.angular : f.linear);
  return S.pitch == 0 ? along : T(along + dot(S.axis, f.linear) * T(S.pitch));
}

// m += S s.
template <class T>
DYNTAPE_INLINE void add_along(const Dof& S, const T& s, Motion<T>& m) {
  add_along(S.axis, s, S.angular ? m.angular : m.linear);
  if (S.pitch != 0) add_along(S.axis, T(s * T(S.pitch)), m.linear);
}

// m x S.
template <class T>
DYNTAPE_INLINE Motion<T> cross(const Motion<T>& m, const Dof& S) {
  const Vector3<T> w = cross(m.angular, S.axis);
  if (!S.angular) return {w, Vector3<T>::Zero()};
  if (S.pitch == 0) return {cross(m.linear, S.axis), w};
  return {cross(m.linear, S.axis) + w * T(S.pitch), w};
}

// S x* f.
template <class T>
DYNTAPE_INLINE Force<T> cross(const Dof& S, const Force<T>& f) {
  const Vector3<T> l = cross(f.linear, S.axis);
  if (!S.angular) return {Vector3<T>::Zero(), -l};
  if (S.pitch == 0) return {-l, -cross(f.angular, S.axis)};
  return {-l, -cross(f.angular, S.axis) - l * T(S.pitch)};
}

}  // namespace dyntape::dynamics
