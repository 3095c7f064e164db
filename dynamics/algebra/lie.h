// SPDX-License-Identifier: BSD-3-Clause
//
// Rotations and rigid placements as Lie groups: exponential, logarithm and their Jacobians.
//
//   Placement<double> X1 = X0 * exp(xi);              // xi: displacement in the body frame of X0 (m, rad)
//   Motion<double>    xi = log(inverse(X0) * X1);     // the inverse, |angular| <= pi
//   Matrix6<double>   J  = right_jacobian(xi);        // in the body frame: exp(xi + d) = exp(xi) exp(J d)
//
// With W = [w]x, z = w.w and the coefficients c_k(z) of stumpff.h:
//   exp w            = 1 + c_1 W + c_2 W^2                              quaternion (c_1(z/4) w / 2, c_0(z/4))
//   Jr(w)            = 1 - c_2 W + c_3 W^2                              Jl(w) = Jr(-w)
//   Jr(w)^-1         = 1 + W/2 + b W^2,   b = (c_2 - c_3)/(4 c_1) at z/4   = (1 - (t/2) cot(t/2)) / t^2
//   exp (v, w)       = (exp w, Jl(w) v)
//   Jr(v, w)         = [Jr(w) Q; 0 Jr(w)],   Q = derivative of Jr at w in direction v, since a screw's
//                      adjoint [W V; 0 W] is W + e V with e^2 = 0
// The formulas hold from 0 (where values, first and second derivatives are exact) to 2 pi.
//
// Quaternions are stored (x y z w) with any nonzero norm, from the smallest double to the largest.  Every function
// normalises its argument, so all routes have the same rotation.  q and -q give results with equal bits.  log
// returns an angle in [0, pi].
#pragma once

#include <dyntape/dynamics/algebra/spatial.h>
#include <dyntape/dynamics/algebra/stumpff.h>

#include <cmath>
#include <type_traits>

namespace dyntape::dynamics {

// |q|^2, summed in the same order for every scalar.
template <class T>
T squared_length(const Vector4<T>& q) {
  return (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
}

// A factor that scales a vector of squared norm z so that squares of its entries neither overflow nor lose digits: a
// power of two if the norm is above 2^384 or below 2^-384 (floats: 48), else one, which changes no bit.  Scalars
// without an order, such as complex ones, are not scaled.
template <class T>
T moderation(const T& z) {
  if constexpr (requires { z < z; }) {
    constexpr int kExponents = std::is_same_v<T, float> ? 128 : 1024, kFar = kExponents * 3 / 4;
    const T large(std::ldexp(1.0, kFar)), little(std::ldexp(1.0, -kFar));
    return select(large < z, little, select(z < little, large, T(1)));
  } else {
    return T(1);
  }
}

// The same direction with moderate norm.
template <class T>
Vector4<T> moderate(const Vector4<T>& q) {
  return q * moderation(squared_length(q));
}

// A quaternion (x y z w), of any nonzero norm.
template <class T>
Matrix3<T> rotation(const Vector4<T>& of_any_length) {
  const Vector4<T> q = moderate(of_any_length);
  const T s = T(2) / squared_length(q);
  const T x = q[0] * s, y = q[1] * s, z = q[2] * s;
  const T xx = x * q[0], yy = y * q[1], zz = z * q[2];
  const T xy = x * q[1], xz = x * q[2], yz = y * q[2];
  const T wx = x * q[3], wy = y * q[3], wz = z * q[3];
  Matrix3<T> R;
  R << T(1) - (yy + zz), xy - wz, xz + wy, xy + wz, T(1) - (xx + zz), yz - wx, xz - wy, yz + wx,
      T(1) - (xx + yy);
  return R;
}

// Rotation a, then rotation b in its frame.
template <class T>
Vector4<T> quaternion_product(const Vector4<T>& a, const Vector4<T>& b) {
  const Vector3<T> u = a.template head<3>(), v = b.template head<3>();
  const Vector3<T> s = u * b[3] + v * a[3] + u.cross(v);
  return {s[0], s[1], s[2], a[3] * b[3] - u.dot(v)};
}

template <class T>
Vector4<T> conjugate(const Vector4<T>& q) {
  return {-q[0], -q[1], -q[2], q[3]};
}

template <class T>
Vector4<T> normalized(const Vector4<T>& of_any_length) {
  const Vector4<T> q = moderate(of_any_length);
  return q * T(T(1) / sqrt(squared_length(q)));
}

// A quaternion of the rotation R, from the row of 4 q q^T (linear in R) with the largest diagonal.  There is no
// square root of a difference, so half a turn is as accurate as any angle.
template <class T>
Vector4<T> quaternion(const Matrix3<T>& R) {
  Eigen::Matrix<T, 4, 4> K;  // 4 q q^T
  const T xy = R(0, 1) + R(1, 0), xz = R(0, 2) + R(2, 0), yz = R(1, 2) + R(2, 1);
  const T xw = R(2, 1) - R(1, 2), yw = R(0, 2) - R(2, 0), zw = R(1, 0) - R(0, 1);
  const T xx = T(1) + R(0, 0) - R(1, 1) - R(2, 2), yy = T(1) - R(0, 0) + R(1, 1) - R(2, 2);
  const T zz = T(1) - R(0, 0) - R(1, 1) + R(2, 2), ww = T(1) + R(0, 0) + R(1, 1) + R(2, 2);
  K << xx, xy, xz, xw, xy, yy, yz, yw, xz, yz, zz, zw, xw, yw, zw, ww;
  Vector4<T> row = K.col(3);
  T largest = K(3, 3);
  for (int k = 0; k < 3; ++k) {
    const auto larger = largest < K(k, k);
    for (int i = 0; i < 4; ++i) row[i] = select(larger, K(i, k), row[i]);
    largest = select(larger, K(k, k), largest);
  }
  return normalized(row);
}

// The quaternion of a rotation vector w (rad).
template <class T>
Vector4<T> exp_quaternion(const Vector3<T>& w) {
  const T z = w.squaredNorm() * T(0.25);
  const T s = stumpff<1>(z) * T(0.5);
  return {w[0] * s, w[1] * s, w[2] * s, stumpff<0>(z)};
}

template <class T>
Matrix3<T> exp(const Vector3<T>& w) {
  const T z = w.squaredNorm();
  const Matrix3<T> W = skew(w);
  return Matrix3<T>::Identity() + W * stumpff<1>(z) + W * W * stumpff<2>(z);
}

// Rotation vector of a quaternion, |w| <= pi.  With v, w the parts of the representative with w >= 0 (if w is zero:
// last nonzero entry of v positive) and n = |q|:  4 atan(|v| / (n + w)) / |v| v, smooth up to and including half a
// turn.
template <class T>
Vector3<T> log(const Vector4<T>& of_any_length) {
  const Vector4<T> q = moderate(of_any_length);
  const T one = T(1), minus = T(-1), zero = T(0);
  const auto sign = [&](const T& x, const T& of_zero) {
    return select(x < zero, minus, select(x > zero, one, of_zero));
  };
  // Not a loop: gcc 12 vectorises it and uses the first sign for the last.
  const T sheet = sign(q[3], sign(q[2], sign(q[1], sign(q[0], one))));
  const Vector3<T> v = q.template head<3>() * sheet;
  const T s = v.squaredNorm(), w = q[3] * sheet;
  const T d = sqrt(s + w * w) + w;
  return v * T(T(4) * atan_ratio(T(s / (d * d))) / d);
}

template <class T>
Vector3<T> log(const Matrix3<T>& R) {
  return log(quaternion(R));
}

template <class T>
Matrix3<T> right_jacobian(const Vector3<T>& w) {
  const T z = w.squaredNorm();
  const Matrix3<T> W = skew(w);
  return Matrix3<T>::Identity() - W * stumpff<2>(z) + W * W * stumpff<3>(z);
}

// b(z) of the inverse Jacobian, for |w| below 2 pi.
template <class T>
T inverse_jacobian_coefficient(const T& z) {
  const T quarter = z * T(0.25);
  return (stumpff<2>(quarter) - stumpff<3>(quarter)) / (T(4) * stumpff<1>(quarter));
}

template <class T>
Matrix3<T> inverse_right_jacobian(const Vector3<T>& w) {
  const Matrix3<T> W = skew(w);
  return Matrix3<T>::Identity() + W * T(0.5) + W * W * inverse_jacobian_coefficient(T(w.squaredNorm()));
}

template <class T>
Placement<T> exp(const Motion<T>& xi) {
  const Vector3<T>&w = xi.angular, &v = xi.linear;
  const T z = w.squaredNorm(), c2 = stumpff<2>(z), c3 = stumpff<3>(z);
  const Vector3<T> wv = w.cross(v);
  const Matrix3<T> W = skew(w);
  return {Matrix3<T>::Identity() + W * stumpff<1>(z) + W * W * c2, v + wv * c2 + w.cross(wv) * c3};
}

template <class T>
Motion<T> log(const Placement<T>& X) {
  const Vector3<T> w = log(X.R);
  return {inverse_right_jacobian(Vector3<T>(-w)) * X.p, w};
}

template <class T>
Matrix6<T> right_jacobian(const Motion<T>& xi) {
  const T z = xi.angular.squaredNorm(), wv = xi.angular.dot(xi.linear);
  const T c2 = stumpff<2>(z), c3 = stumpff<3>(z), c4 = stumpff<4>(z), c5 = stumpff<5>(z);
  const T d2 = T(2) * c4 - c3, d3 = T(3) * c5 - c4;  // twice the derivatives of c2 and c3
  const Matrix3<T> W = skew(xi.angular), V = skew(xi.linear), WW = W * W;
  const Matrix3<T> J = Matrix3<T>::Identity() - W * c2 + WW * c3;
  Matrix6<T> m = Matrix6<T>::Zero();
  m.template topLeftCorner<3, 3>() = J;
  m.template bottomRightCorner<3, 3>() = J;
  m.template topRightCorner<3, 3>() = (V * W + W * V) * c3 - V * c2 + (WW * d3 - W * d2) * wv;
  return m;
}

template <class T>
Matrix6<T> inverse_right_jacobian(const Motion<T>& xi) {
  const Matrix6<T> J = right_jacobian(xi);
  const Matrix3<T> Ji = inverse_right_jacobian(xi.angular);
  const Matrix3<T> Q = J.template topRightCorner<3, 3>();
  Matrix6<T> m = Matrix6<T>::Zero();
  m.template topLeftCorner<3, 3>() = Ji;
  m.template bottomRightCorner<3, 3>() = Ji;
  m.template topRightCorner<3, 3>() = -(Ji * Q * Ji);
  return m;
}

}  // namespace dyntape::dynamics
