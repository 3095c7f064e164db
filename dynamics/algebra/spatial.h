// SPDX-License-Identifier: BSD-3-Clause
//
// Spatial vectors: rigid placements, motions, forces and inertias.  Linear part first, as Pinocchio.
//
//   Placement<double> X_WB{R_WB, p_WB};               // places frame B in frame W: p_W = R p_B + p
//   Motion<double> v_B = act_inverse(X_WB, v_W);      // the same motion in frame B
//   double power = dot(v_B, f_B);                     // W
//
// Frames.  X_AB maps coordinates from B to A.  With t = X_AB.p:
//   motion  V_A = (R l + t x R w, R w)      l: velocity of the point at the frame's origin (m/s), w: rad/s
//   force   F_A = (R f, R n + t x R f)      f: force (N), n: moment about the frame's origin (N m)
// Motion and force are dual: dot(V, F) is the power, independent of the frame.
//
// Inertias are stored about the centre of mass, so that a large translation loses no digit of the rotational part;
// about another point the parallel-axis theorem adds m (|c|^2 1 - c c^T).
#pragma once

#include <dyntape/dynamics/algebra/scalar.h>

namespace dyntape::dynamics {

// |c|^2 1 - c c^T: the rotational inertia of a unit point mass at c, about the origin.
template <class T>
DYNTAPE_INLINE Matrix3<T> unit_point_inertia(const Vector3<T>& c) {
  const T xx = c[0] * c[0], yy = c[1] * c[1], zz = c[2] * c[2];
  const T xy = -(c[0] * c[1]), xz = -(c[0] * c[2]), yz = -(c[1] * c[2]);
  return {yy + zz, xy, xz, xy, xx + zz, yz, xz, yz, xx + yy};
}

// A rigid placement of one frame in another.
template <class T>
struct Placement {
  Matrix3<T> R = Matrix3<T>::Identity();
  Vector3<T> p = Vector3<T>::Zero();

  template <class S>
  Placement<S> cast() const {
    return {R.template cast<S>(), p.template cast<S>()};
  }
};

// X_AC = X_AB * X_BC.
template <class T>
DYNTAPE_INLINE Placement<T> operator*(const Placement<T>& a, const Placement<T>& b) {
  return {a.R * b.R, a.p + a.R * b.p};
}

// X_BA from X_AB.
template <class T>
DYNTAPE_INLINE Placement<T> inverse(const Placement<T>& X) {
  const Matrix3<T> Rt = X.R.transpose();
  return {Rt, -(Rt * X.p)};
}

// Velocity, acceleration or displacement of a frame: linear of its origin, angular.
template <class T>
struct Motion {
  Vector3<T> linear = Vector3<T>::Zero();
  Vector3<T> angular = Vector3<T>::Zero();

  Vector6<T> vector() const { return (Vector6<T>() << linear, angular).finished(); }
};

// Force, or momentum: linear, and moment about the frame's origin.
template <class T>
struct Force {
  Vector3<T> linear = Vector3<T>::Zero();
  Vector3<T> angular = Vector3<T>::Zero();

  Vector6<T> vector() const { return (Vector6<T>() << linear, angular).finished(); }
};

template <class T>
DYNTAPE_INLINE Motion<T> operator+(const Motion<T>& a, const Motion<T>& b) {
  return {a.linear + b.linear, a.angular + b.angular};
}
template <class T>
DYNTAPE_INLINE Motion<T> operator-(const Motion<T>& a, const Motion<T>& b) {
  return {a.linear - b.linear, a.angular - b.angular};
}
template <class T>
DYNTAPE_INLINE Force<T> operator+(const Force<T>& a, const Force<T>& b) {
  return {a.linear + b.linear, a.angular + b.angular};
}
template <class T>
DYNTAPE_INLINE Force<T> operator-(const Force<T>& a, const Force<T>& b) {
  return {a.linear - b.linear, a.angular - b.angular};
}

template <class T>
DYNTAPE_INLINE Force<T> operator*(const Force<T>& f, const T& s) {
  return {f.linear * s, f.angular * s};
}

// Power of a force along a motion, both in one frame.
template <class T>
DYNTAPE_INLINE T dot(const Motion<T>& m, const Force<T>& f) {
  return m.linear.dot(f.linear) + m.angular.dot(f.angular);
}

// a x b: rate of change of a motion b fixed to a body that moves with a.
template <class T>
DYNTAPE_INLINE Motion<T> cross(const Motion<T>& a, const Motion<T>& b) {
  return {a.angular.cross(b.linear) + a.linear.cross(b.angular), a.angular.cross(b.angular)};
}

// a x* f: rate of change of a force f fixed to a body that moves with a.
template <class T>
DYNTAPE_INLINE Force<T> cross(const Motion<T>& a, const Force<T>& f) {
  return {a.angular.cross(f.linear), a.angular.cross(f.angular) + a.linear.cross(f.linear)};
}

// V_A from V_B.
template <class T>
DYNTAPE_INLINE Motion<T> act(const Placement<T>& X_AB, const Motion<T>& m) {
  const Vector3<T> w = X_AB.R * m.angular;
  return {X_AB.R * m.linear + X_AB.p.cross(w), w};
}
// V_B from V_A.
template <class T>
DYNTAPE_INLINE Motion<T> act_inverse(const Placement<T>& X_AB, const Motion<T>& m) {
  return {transposed_times(X_AB.R, m.linear - X_AB.p.cross(m.angular)), transposed_times(X_AB.R, m.angular)};
}
// F_A from F_B.
template <class T>
DYNTAPE_INLINE Force<T> act(const Placement<T>& X_AB, const Force<T>& f) {
  const Vector3<T> l = X_AB.R * f.linear;
  return {l, X_AB.R * f.angular + X_AB.p.cross(l)};
}
// Adds f, given in B, to a force in A.
template <class T>
DYNTAPE_INLINE void accumulate(const Placement<T>& X_AB, const Force<T>& f, Force<T>& parent) {
  parent = parent + act(X_AB, f);
}

// Matrix of act(X_AB, motion), linear first (6 x 6).
template <class T>
DYNTAPE_INLINE Matrix6<T> action_matrix(const Placement<T>& X_AB) {
  Matrix6<T> m = Matrix6<T>::Zero();
  m.template topLeftCorner<3, 3>() = X_AB.R;
  m.template topRightCorner<3, 3>() = skew(X_AB.p) * X_AB.R;
  m.template bottomRightCorner<3, 3>() = X_AB.R;
  return m;
}

// Mass (kg), centre of mass (m) and rotational inertia about the centre of mass (kg m^2), in body axes.
template <class T>
struct Inertia {
  T mass = T(0);
  Vector3<T> com = Vector3<T>::Zero();
  Matrix3<T> I_c = Matrix3<T>::Zero();  // symmetric

  template <class S>
  Inertia<S> cast() const {
    return {static_cast<S>(mass), com.template cast<S>(), I_c.template cast<S>()};
  }
};

// 1 / mass, or zero if massless.
template <class T>
DYNTAPE_INLINE T per_mass(const T& mass) {
  return select(mass > T(0), T(1) / select(mass > T(0), mass, T(1)), T(0));
}

// Two bodies welded together, both in one frame.  With d = c_a - c_b and the reduced mass m_a m_b / (m_a + m_b)
// nothing is subtracted.  Two massless bodies give a massless body at the origin.
template <class T>
DYNTAPE_INLINE Inertia<T> operator+(const Inertia<T>& a, const Inertia<T>& b) {
  const T mass = a.mass + b.mass;
  const T share = per_mass(mass);
  const Vector3<T> com = (a.mass * a.com + b.mass * b.com) * share;
  const Vector3<T> d = a.com - b.com;
  return {mass, com, a.I_c + b.I_c + unit_point_inertia(d) * T(a.mass * b.mass * share)};
}

// The body in frame A.
template <class T>
DYNTAPE_INLINE Inertia<T> act(const Placement<T>& X_AB, const Inertia<T>& I) {
  return {I.mass, X_AB.R * I.com + X_AB.p, rotate_symmetric(X_AB.R, I.I_c)};
}

// Momentum I v.
template <class T>
DYNTAPE_INLINE Force<T> operator*(const Inertia<T>& I, const Motion<T>& v) {
  const Vector3<T> momentum = (v.linear + v.angular.cross(I.com)) * I.mass;
  return {momentum, I.I_c * v.angular + I.com.cross(momentum)};
}

}  // namespace dyntape::dynamics
