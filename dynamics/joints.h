// SPDX-License-Identifier: BSD-3-Clause
//
// Everything that distinguishes one joint type from another.  To add a joint: a name in JointType (model.h),
// a row in joints.cpp, and a case in each switch of this file; the algorithms and the tests follow.
//
//   Placement<T> X_PB = joint_placement(joint, X_PJ, q);   // body in its parent
//   integrate(joint, q, v, q_next);                        // q_next = q (+) v, only this joint's entries
//
// q, v are whole vectors (nq), (nv); each function touches the entries of its joint.
//
//   type        q                        X_J(q)            S (constant in the moving frame)
//   revolute    angle                    Rot(axis, q)      (0; axis)
//   continuous  (cos, sin), any length   Rot(axis, angle)  (0; axis)
//   prismatic   displacement             Trans(axis q)     (axis; 0)
//   free-flyer  position, quaternion     (R(q), p)         1 (6 x 6)
//
// A tangent v is a displacement in the moving frame: X_J(q (+) v) = X_J(q) exp(S v).  Pairs (cos, sin) and
// quaternions are divided by their length wherever they enter.
#pragma once

#include <dyntape/dynamics/lie.h>
#include <dyntape/dynamics/model.h>

#include <dyntape/dynamics/axis.h>
#include <random>
#include <vector>

namespace dyntape::dynamics {

// The columns of S, in the order of v.
template <class T>
std::vector<Dof> joint_dofs(const Joint<T>& joint, int index) {
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kContinuous:
      return {{index, true, Axis::from(joint.axis)}};
    case JointType::kPrismatic:
      return {{index, false, Axis::from(joint.axis)}};
    case JointType::kFreeFlyer:
      break;
  }
  std::vector<Dof> dofs;
  for (int k = 0; k < 6; ++k) dofs.push_back({index, k >= 3, Axis::from(Eigen::Vector3d::Unit(k % 3))});
  return dofs;
}

namespace detail {

// Unit (cos, sin) of a pair of any length but zero.
template <class T>
std::pair<T, T> direction(const T& c, const T& s) {
  const T scale = T(1) / sqrt(c * c + s * s);
  return {c * scale, s * scale};
}

// exp of the tangent from one free-flyer configuration to another.
template <class T>
Motion<T> free_flyer_difference(const VectorRef<T>& q0, const VectorRef<T>& q1, int i) {
  const Vector4<T> u0 = q0.template segment<4>(i + 3), u1 = q1.template segment<4>(i + 3);
  const Vector3<T> w = log(quaternion_product(conjugate(u0), u1));
  const Vector3<T> dp = q1.template segment<3>(i) - q0.template segment<3>(i);
  const Vector3<T> p = rotation(u0).transpose() * dp;
  return {inverse_right_jacobian(Vector3<T>(-w)) * p, w};
}

}  // namespace detail

// Placement of the joint's body in its parent: X_PJ X_J(q).
template <class T>
Placement<T> joint_placement(const Joint<T>& joint, const Axis& axis, const Placement<T>& X_PJ,
                             const VectorRef<T>& q) {
  const int i = joint.idx_q;
  switch (joint.type) {
    case JointType::kRevolute: {
      const T angle = q[i];
      return {rotate_about(X_PJ.R, axis, T(cos(angle)), T(sin(angle))), X_PJ.p};
    }
    case JointType::kContinuous: {
      const auto [c, s] = detail::direction<T>(q[i], q[i + 1]);
      return {rotate_about(X_PJ.R, axis, c, s), X_PJ.p};
    }
    case JointType::kPrismatic:
      return {X_PJ.R, X_PJ.p + times(X_PJ.R, axis) * q[i]};
    case JointType::kFreeFlyer:
      break;
  }
  const Vector4<T> u = q.template segment<4>(i + 3);
  const Vector3<T> p = q.template segment<3>(i);
  return {X_PJ.R * rotation(u), X_PJ.p + X_PJ.R * p};
}

// q_next = q (+) v.
template <class T>
void integrate(const Joint<T>& joint, const VectorRef<T>& q, const VectorRef<T>& v, VectorX<T>& q_next) {
  const int i = joint.idx_q, k = joint.idx_v;
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
      q_next[i] = q[i] + v[k];
      return;
    case JointType::kContinuous: {
      const auto [c, s] = detail::direction<T>(q[i], q[i + 1]);
      const T dc = cos(v[k]), ds = sin(v[k]);
      q_next[i] = c * dc - s * ds;
      q_next[i + 1] = s * dc + c * ds;
      return;
    }
    case JointType::kFreeFlyer:
      break;
  }
  const Vector4<T> u = normalized(Vector4<T>(q.template segment<4>(i + 3)));
  const Motion<T> xi{v.template segment<3>(k), v.template segment<3>(k + 3)};
  const T z = xi.angular.squaredNorm();
  const Vector3<T> wv = xi.angular.cross(xi.linear);
  const Vector3<T> dp = xi.linear + wv * stumpff<2>(z) + xi.angular.cross(wv) * stumpff<3>(z);
  q_next.template segment<3>(i) = q.template segment<3>(i) + rotation(u) * dp;
  q_next.template segment<4>(i + 3) = quaternion_product(u, exp_quaternion(xi.angular));
}

// v with q0 (+) v = q1; angles in [-pi, pi].
template <class T>
void difference(const Joint<T>& joint, const VectorRef<T>& q0, const VectorRef<T>& q1, VectorX<T>& v) {
  const int i = joint.idx_q, k = joint.idx_v;
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
      v[k] = q1[i] - q0[i];
      return;
    case JointType::kContinuous: {
      const T c = q0[i] * q1[i] + q0[i + 1] * q1[i + 1], s = q0[i] * q1[i + 1] - q0[i + 1] * q1[i];
      v[k] = atan2(s, c);
      return;
    }
    case JointType::kFreeFlyer:
      break;
  }
  const Motion<T> xi = detail::free_flyer_difference<T>(q0, q1, i);
  v.template segment<3>(k) = xi.linear;
  v.template segment<3>(k + 3) = xi.angular;
}

// Tangent Jacobians of q (+) v, body-frame increments on both sides: with respect to q and to v.
//   d_q = matrix of act(exp(v)^-1),  d_v = right Jacobian of v
template <class T>
void integrate_jacobians(const Joint<T>& joint, const VectorRef<T>& v, MatrixX<T>& d_q, MatrixX<T>& d_v) {
  const int k = joint.idx_v;
  if (joint.type != JointType::kFreeFlyer) {
    d_q(k, k) = d_v(k, k) = T(1);
    return;
  }
  const Motion<T> xi{v.template segment<3>(k), v.template segment<3>(k + 3)};
  d_q.template block<6, 6>(k, k) = action_matrix(inverse(exp(xi)));
  d_v.template block<6, 6>(k, k) = right_jacobian(xi);
}

// Tangent Jacobians of v = q1 (-) q0, with respect to q0 and to q1: -Jr(-v)^-1 and Jr(v)^-1.
template <class T>
void difference_jacobians(const Joint<T>& joint, const VectorRef<T>& v, MatrixX<T>& d_q0, MatrixX<T>& d_q1) {
  const int k = joint.idx_v;
  if (joint.type != JointType::kFreeFlyer) {
    d_q0(k, k) = T(-1);
    d_q1(k, k) = T(1);
    return;
  }
  const Motion<T> xi{v.template segment<3>(k), v.template segment<3>(k + 3)};
  d_q0.template block<6, 6>(k, k) = -inverse_right_jacobian(Motion<T>{-xi.linear, -xi.angular});
  d_q1.template block<6, 6>(k, k) = inverse_right_jacobian(xi);
}

// The configuration in which X_J is the identity.
template <class T>
void neutral(const Joint<T>& joint, VectorX<T>& q) {
  q.segment(joint.idx_q, nq(joint.type)).setZero();
  if (joint.type == JointType::kContinuous) q[joint.idx_q] = T(1);
  if (joint.type == JointType::kFreeFlyer) q[joint.idx_q + 6] = T(1);
}

// Uniform between the limits, in [-pi, pi] (rad) or [-1, 1] (m) where there are none; rotations uniform.
template <class T>
void random_configuration(const Joint<T>& joint, std::mt19937_64& random, VectorX<T>& q) {
  const int i = joint.idx_q;
  const auto uniform = [&](double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  constexpr double kPi = 3.14159265358979323846;
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kPrismatic: {
      const double range = joint.type == JointType::kPrismatic ? 1 : kPi;
      double lower = joint.limits.lower, upper = joint.limits.upper;
      if (!std::isfinite(lower)) lower = std::isfinite(upper) ? upper - 2 * range : -range;
      if (!std::isfinite(upper)) upper = lower + 2 * range;
      q[i] = T(uniform(lower, upper));
      return;
    }
    case JointType::kContinuous: {
      const double angle = uniform(-kPi, kPi);
      q[i] = T(std::cos(angle));
      q[i + 1] = T(std::sin(angle));
      return;
    }
    case JointType::kFreeFlyer:
      break;
  }
  for (int k = 0; k < 3; ++k) q[i + k] = T(uniform(-1, 1));
  // Shoemake: two random circles, weighted so that the quaternion is uniform on the sphere.
  const double u = uniform(0, 1), a = uniform(-kPi, kPi), b = uniform(-kPi, kPi);
  q[i + 3] = T(std::sqrt(1 - u) * std::sin(a));
  q[i + 4] = T(std::sqrt(1 - u) * std::cos(a));
  q[i + 5] = T(std::sqrt(u) * std::sin(b));
  q[i + 6] = T(std::sqrt(u) * std::cos(b));
}

}  // namespace dyntape::dynamics
