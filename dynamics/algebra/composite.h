// SPDX-License-Identifier: BSD-3-Clause
//
// Quantities that the recursions accumulate along a tree: composite inertias, articulated inertias, velocity
// products.
//
//   Composite<double> sum = composite(inertia_of_leaf);
//   accumulate(X_PB, sum, parent_sum);       // parent_sum += sum, transformed to the parent
//
// All quantities are about the origin of their frame; t = X_PB.p, r' = R r + t.
#pragma once

#include <dyntape/dynamics/algebra/axis.h>

namespace dyntape::dynamics {

// A rigid body, or several welded together: mass, h = m c, and inertia about the origin.  Unlike Inertia it adds
// without division, so massless parts need no special case.
template <class T>
struct Composite {
  T mass = T(0);
  Vector3<T> h = Vector3<T>::Zero();
  Matrix3<T> I_o = Matrix3<T>::Zero();  // symmetric
};

template <class T>
DYNTAPE_INLINE Composite<T> composite(const Inertia<T>& I) {
  return {I.mass, I.com * I.mass, I.I_c + unit_point_inertia(I.com) * I.mass};
}

template <class T>
DYNTAPE_INLINE Force<T> operator*(const Composite<T>& I, const Motion<T>& v) {
  return {v.linear * I.mass + v.angular.cross(I.h), I.I_o * v.angular + I.h.cross(v.linear)};
}

// I S for a column of a motion subspace.
template <class T>
DYNTAPE_INLINE Force<T> operator*(const Composite<T>& I, const Dof& S) {
  if (S.angular && S.pitch == 0) return {-cross(I.h, S.axis), times(I.I_o, S.axis)};
  const Vector3<T> moment = cross(I.h, S.axis);
  if (!S.angular) {
    Vector3<T> linear = Vector3<T>::Zero();
    add_along(S.axis, I.mass, linear);
    return {linear, moment};
  }
  Vector3<T> linear = -moment;
  add_along(S.axis, T(I.mass * T(S.pitch)), linear);
  return {linear, times(I.I_o, S.axis) + moment * T(S.pitch)};
}

// docs/math.md (S.9).  With g = R h + m t / 2:  I_o' = R I_o R^T + 2 (t.g) 1 - g t^T - t g^T,  h' = R h + m t.
template <class T>
DYNTAPE_INLINE void accumulate(const Placement<T>& X_PB, const Composite<T>& I, Composite<T>& parent) {
  const Vector3<T>& t = X_PB.p;
  const Vector3<T> h = X_PB.R * I.h, mt = t * I.mass;
  const Vector3<T> g = h + mt * T(0.5);
  const Matrix3<T> rotated = rotate_symmetric(X_PB.R, I.I_o);
  const Vector3<T> gt = g.cwiseProduct(t) * T(2);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    parent.I_o(i, i) += rotated(i, i) + (gt[j] + gt[k]);
    const T off = rotated(j, k) - (g[j] * t[k] + g[k] * t[j]);
    parent.I_o(j, k) += off;
    parent.I_o(k, j) = parent.I_o(j, k);
  }
  parent.mass += I.mass;
  parent.h += h + mt;
}

// The velocity terms in the derivatives of inverse dynamics, as integrals over the mass, with u the velocity of a
// point at r:
//   p = int u dm,   U = int u r^T dm.
// The matrix of velocity products of a set of bodies (Coriolis and gyroscopic, twice the B of the literature) is 2 B
// (l, w) = (-2 p x w,  2 (tr(U) w - U w)):  independent of l.
template <class T>
struct VelocityProduct {
  Vector3<T> p = Vector3<T>::Zero();
  Matrix3<T> U = Matrix3<T>::Zero();
};

// Of one body with velocity (l, w): p = m l + w x h,  U = l h^T + [w]x (tr(I_o)/2 1 - I_o).
template <class T>
DYNTAPE_INLINE VelocityProduct<T> velocity_product(const Composite<T>& I, const Motion<T>& v) {
  Matrix3<T> second_moment = -I.I_o;
  const T half_trace = (I.I_o(0, 0) + I.I_o(1, 1) + I.I_o(2, 2)) * T(0.5);
  for (int k = 0; k < 3; ++k) second_moment(k, k) += half_trace;
  VelocityProduct<T> w{v.linear * I.mass + v.angular.cross(I.h), outer(v.linear, I.h)};
  for (int k = 0; k < 3; ++k) w.U.set_column(k, w.U.column(k) + v.angular.cross(second_moment.column(k)));
  return w;
}

// u does not depend on the frame's origin, r does: U' = R U R^T + (R p) t^T.
template <class T>
DYNTAPE_INLINE void accumulate(const Placement<T>& X_PB, const VelocityProduct<T>& w,
                               VelocityProduct<T>& parent) {
  const Vector3<T> p = X_PB.R * w.p;
  const Matrix3<T> RU = X_PB.R * w.U;
  parent.U += times_transposed(RU, X_PB.R) + outer(p, X_PB.p);
  parent.p += p;
}

// 2 B m for a motion with angular part w.
template <class T>
DYNTAPE_INLINE Force<T> twice_b(const VelocityProduct<T>& b, const Vector3<T>& w) {
  const T trace = b.U(0, 0) + b.U(1, 1) + b.U(2, 2);
  return {w.cross(b.p) * T(2), (w * trace - b.U * w) * T(2)};
}

// Angular part of (2 B)^T S; its linear part is zero.  docs/math.md (D.15), (D.16).
template <class T>
DYNTAPE_INLINE Vector3<T> twice_b_transposed(const VelocityProduct<T>& b, const Dof& S) {
  if (!S.angular) return cross(b.p, S.axis) * T(2);
  Vector3<T> w = -times(Matrix3<T>(b.U.transpose()), S.axis);
  add_along(S.axis, T(b.U(0, 0) + b.U(1, 1) + b.U(2, 2)), w);
  if (S.pitch != 0) w += cross(b.p, S.axis) * T(S.pitch);
  return w * T(2);
}

// Articulated inertia: force = (M l + H w, H^T l + J w); M and J symmetric.
template <class T>
struct Articulated {
  Matrix3<T> M = Matrix3<T>::Zero(), H = Matrix3<T>::Zero(), J = Matrix3<T>::Zero();
};

template <class T>
DYNTAPE_INLINE Articulated<T> articulated(const Inertia<T>& I) {
  const Composite<T> c = composite(I);
  return {Matrix3<T>::Identity() * I.mass, skew(Vector3<T>(-c.h)), c.I_o};
}

template <class T>
DYNTAPE_INLINE Force<T> operator*(const Articulated<T>& I, const Motion<T>& m) {
  return {I.M * m.linear + I.H * m.angular, transposed_times(I.H, m.linear) + I.J * m.angular};
}

template <class T>
DYNTAPE_INLINE Force<T> operator*(const Articulated<T>& I, const Dof& S) {
  if (S.angular && S.pitch == 0) return {times(I.H, S.axis), times(I.J, S.axis)};
  const Force<T> pushed{times(I.M, S.axis), times(Matrix3<T>(I.H.transpose()), S.axis)};
  if (!S.angular) return pushed;
  const T h(S.pitch);
  return {times(I.H, S.axis) + pushed.linear * h, times(I.J, S.axis) + pushed.angular * h};
}

// I - U U^T / D for U = I S, D = S.U + armature.  Along S the remainder is U armature / D, computed as such: it is
// exactly zero without armature, also on the tape.
template <class T>
DYNTAPE_INLINE Articulated<T> without(const Articulated<T>& I, const Dof& S, const Force<T>& U,
                                      const T& D_inverse, const T& armature) {
  const Vector3<T> l = U.linear * D_inverse, n = U.angular * D_inverse;
  const int k = S.pitch == 0 ? S.axis.index : -1;
  const T left = armature * D_inverse;
  Articulated<T> A;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) A.H.at(i, j) = I.H.at(i, j) - U.linear.at(i) * n.at(j);
    for (int j = 0; j <= i; ++j) {
      A.M.at(i, j) = A.M.at(j, i) = I.M.at(i, j) - U.linear.at(i) * l.at(j);
      A.J.at(i, j) = A.J.at(j, i) = I.J.at(i, j) - U.angular.at(i) * n.at(j);
    }
  }
  if (k < 0) return A;
  const T along = S.axis.flipped ? T(-left) : left;
  for (int i = 0; i < 3; ++i) {
    if (S.angular) {
      A.H.at(i, k) = U.linear.at(i) * along;
      A.J.at(i, k) = A.J.at(k, i) = U.angular.at(i) * along;
    } else {
      A.H.at(k, i) = U.angular.at(i) * along;
      A.M.at(i, k) = A.M.at(k, i) = U.linear.at(i) * along;
    }
  }
  return A;
}

// X^-T I X^-1, docs/math.md (S.10):  M' = R M R^T,  H' = R H R^T - M' [t],
// J' = R J R^T + ([t] R H R^T)^T + [t] H'.
template <class T>
DYNTAPE_INLINE void accumulate(const Placement<T>& X_PB, const Articulated<T>& I, Articulated<T>& parent) {
  const Matrix3<T>& R = X_PB.R;
  const Vector3<T>& t = X_PB.p;
  const Matrix3<T> M = rotate_symmetric(R, I.M), J = rotate_symmetric(R, I.J);
  const Matrix3<T> H = times_transposed(Matrix3<T>(R * I.H), R);
  Matrix3<T> shifted;  // H'
  for (int i = 0; i < 3; ++i) {
    const Vector3<T> row = t.cross(Vector3<T>(M.at(i, 0), M.at(i, 1), M.at(i, 2)));
    for (int j = 0; j < 3; ++j) shifted.at(i, j) = H.at(i, j) + row.at(j);
  }
  Matrix3<T> turned, moved;  // [t] R H R^T,  [t] H'
  for (int j = 0; j < 3; ++j) {
    turned.set_column(j, t.cross(H.column(j)));
    moved.set_column(j, t.cross(shifted.column(j)));
  }
  parent.M += M;
  parent.H += shifted;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      parent.J.at(i, j) += J.at(i, j) + (turned.at(i, j) + moved.at(j, i));
      parent.J.at(j, i) = parent.J.at(i, j);
    }
  }
}

}  // namespace dyntape::dynamics
