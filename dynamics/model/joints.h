// SPDX-License-Identifier: BSD-3-Clause
//
// The joint types: placement, tangent space and limits of each.  To add a joint: a name in JointType (model.h), a
// row in its table of traits, and a case in each switch of this file.  Algorithms and tests need no change.
//
//   Placement<T> X_PB = joint_placement(joint, X_PJ, q);   // body in its parent
//   integrate(joint, q, v, q_next);                        // q_next = q (+) v, only this joint's entries
//
// q, v are the robot's whole vectors (nq), (nv); each function uses the entries of its joint.
//
//   type        q                        X_J(q)                           S (constant in the moving frame)
//   revolute    angle                    Rot(axis, q)                     (0; axis)
//   continuous  (cos, sin), any length   Rot(axis, angle)                 (0; axis)
//   prismatic   displacement             Trans(axis q)                    (axis; 0)
//   helical     angle                    Rot(axis, q), Trans(axis h q)    (h axis; axis), h = joint.pitch
//   spherical   quaternion               R(q)                             (0; 1)
//   planar      x, y, (cos, sin)         Trans(x, y, 0) Rot(z, angle)     (x; 0), (y; 0), (0; z)
//   free-flyer  position, quaternion     (R(q), p)                        1 (6 x 6)
//
// A tangent v is a displacement in the moving frame: X_J(q (+) v) = X_J(q) exp(S v).  Pairs (cos, sin) and
// quaternions are normalised in every function.  A universal joint is two revolute joints (add_universal): with the
// cross between them S is constant, and no algorithm changes.
#pragma once

#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/model/model.h>

#include <dyntape/dynamics/algebra/axis.h>
#include <random>
#include <vector>

namespace dyntape::dynamics {

namespace detail {

// The direction (of six: linear, angular) of column c of a joint with several columns.
constexpr int direction_of_column(JointType type, int c) {
  if (type == JointType::kSpherical) return c + 3;
  return type == JointType::kPlanar && c == 2 ? 5 : c;
}

}  // namespace detail

// The columns of S, in the order of v.
template <class T>
std::vector<Dof> joint_dofs(const Joint<T>& joint, int index) {
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kContinuous:
      return {{index, true, Axis::from(joint.axis)}};
    case JointType::kPrismatic:
      return {{index, false, Axis::from(joint.axis)}};
    case JointType::kHelical:
      return {{index, true, Axis::from(joint.axis), joint.pitch}};
    case JointType::kSpherical:
    case JointType::kPlanar:
    case JointType::kFreeFlyer:
      break;
  }
  std::vector<Dof> dofs;
  for (int c = 0; c < nv(joint.type); ++c) {
    const int k = detail::direction_of_column(joint.type, c);
    dofs.push_back({index, k >= 3, Axis::from(Eigen::Vector3d::Unit(k % 3))});
  }
  return dofs;
}

namespace detail {

// The same direction with moderate norm (lie.h).
template <class T>
std::pair<T, T> moderate_pair(const T& c, const T& s) {
  const T factor = moderation(T(c * c + s * s));
  return {c * factor, s * factor};
}

// Unit (cos, sin) of a nonzero pair.
template <class T>
std::pair<T, T> direction(const T& of_any_length_c, const T& of_any_length_s) {
  const auto [c, s] = moderate_pair<T>(of_any_length_c, of_any_length_s);
  const T scale = T(1) / sqrt(c * c + s * s);
  return {c * scale, s * scale};
}

// The pair at q[i], rotated by an angle.
template <class T>
void turn(const VectorRef<T>& q, int i, const T& angle, VectorX<T>& q_next) {
  const auto [c, s] = direction<T>(q[i], q[i + 1]);
  T ds, dc;
  sincos(angle, ds, dc);
  q_next[i] = c * dc - s * ds;
  q_next[i + 1] = s * dc + c * ds;
}

// The angle from the pair at q0[i] to that at q1[i].
template <class T>
T angle_between(const VectorRef<T>& q0, const VectorRef<T>& q1, int i) {
  const auto [c0, s0] = moderate_pair<T>(q0[i], q0[i + 1]);
  const auto [c1, s1] = moderate_pair<T>(q1[i], q1[i + 1]);
  return atan2(T(c0 * s1 - s0 * c1), T(c0 * c1 + s0 * s1));
}

// The rotation vector from the quaternion at q0[i] to that at q1[i].
template <class T>
Vector3<T> rotation_between(const VectorRef<T>& q0, const VectorRef<T>& q1, int i) {
  const Vector4<T> u0 = moderate(Vector4<T>(q0.template segment<4>(i))),
                   u1 = moderate(Vector4<T>(q1.template segment<4>(i)));
  return log(quaternion_product(conjugate(u0), u1));
}

// exp of the tangent from one free-flyer configuration to another.
template <class T>
Motion<T> free_flyer_difference(const VectorRef<T>& q0, const VectorRef<T>& q1, int i) {
  const Vector3<T> w = rotation_between<T>(q0, q1, i + 3);
  const Vector3<T> dp = q1.template segment<3>(i) - q0.template segment<3>(i);
  const Vector3<T> p = rotation(Vector4<T>(q0.template segment<4>(i + 3))).transpose() * dp;
  return {inverse_right_jacobian(Vector3<T>(-w)) * p, w};
}

// S v of a joint with several columns.
template <class T>
Motion<T> joint_screw(const Joint<T>& joint, const VectorRef<T>& v) {
  Motion<T> xi;
  for (int c = 0; c < nv(joint.type); ++c) {
    const int k = direction_of_column(joint.type, c);
    (k < 3 ? xi.linear : xi.angular)[k % 3] = v[joint.idx_v + c];
  }
  return xi;
}

// The joint's block of a Jacobian on SE(3): its placements are a subgroup.
template <class T>
void put_block(const Joint<T>& joint, const Matrix6<T>& J, MatrixX<T>& result) {
  for (int r = 0; r < nv(joint.type); ++r) {
    for (int c = 0; c < nv(joint.type); ++c) {
      result(joint.idx_v + r, joint.idx_v + c) =
          J(direction_of_column(joint.type, r), direction_of_column(joint.type, c));
    }
  }
}

}  // namespace detail

// Placement of the body of a revolute or helical joint, from the sine s and the cosine c of its angle q (rad).
template <class T>
DYNTAPE_INLINE Placement<T> turned_placement(const Joint<T>& joint, const Axis& axis,
                                             const Placement<T>& X_PJ, const T& q, const T& s, const T& c) {
  const Matrix3<T> R = rotate_about(X_PJ.R, axis, c, s);
  if (joint.type == JointType::kRevolute) return {R, X_PJ.p};
  return {R, X_PJ.p + times(X_PJ.R, axis) * T(q * T(joint.pitch))};
}

// Placement of the joint's body in its parent: X_PJ X_J(q).
template <class T>
DYNTAPE_INLINE Placement<T> joint_placement(const Joint<T>& joint, const Axis& axis, const Placement<T>& X_PJ,
                                            const VectorRef<T>& q) {
  const int i = joint.idx_q;
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kHelical: {
      T c, s;
      sincos(T(q[i]), s, c);
      return turned_placement<T>(joint, axis, X_PJ, q[i], s, c);
    }
    case JointType::kContinuous: {
      const auto [c, s] = detail::direction<T>(q[i], q[i + 1]);
      return {rotate_about(X_PJ.R, axis, c, s), X_PJ.p};
    }
    case JointType::kPrismatic:
      return {X_PJ.R, X_PJ.p + times(X_PJ.R, axis) * q[i]};
    case JointType::kSpherical:
      return {X_PJ.R * rotation(Vector4<T>(q.template segment<4>(i))), X_PJ.p};
    case JointType::kPlanar: {
      const auto [c, s] = detail::direction<T>(q[i + 2], q[i + 3]);
      return {rotate_about(X_PJ.R, Axis{}, c, s), X_PJ.p + X_PJ.R * Vector3<T>(q[i], q[i + 1], T(0))};
    }
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
    case JointType::kHelical:
      q_next[i] = q[i] + v[k];
      return;
    case JointType::kContinuous:
      detail::turn<T>(q, i, v[k], q_next);
      return;
    case JointType::kSpherical: {
      const Vector4<T> u = normalized(Vector4<T>(q.template segment<4>(i)));
      q_next.template segment<4>(i) =
          quaternion_product(u, exp_quaternion(Vector3<T>(v.template segment<3>(k))));
      return;
    }
    case JointType::kPlanar: {
      const T w = v[k + 2], z = w * w, along = stumpff<1>(z), across = w * stumpff<2>(z);
      const T x = along * v[k] - across * v[k + 1], y = across * v[k] + along * v[k + 1];
      const auto [c, s] = detail::direction<T>(q[i + 2], q[i + 3]);
      q_next[i] = q[i] + (c * x - s * y);
      q_next[i + 1] = q[i + 1] + (s * x + c * y);
      detail::turn<T>(q, i + 2, w, q_next);
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
    case JointType::kHelical:
      v[k] = q1[i] - q0[i];
      return;
    case JointType::kContinuous:
      v[k] = detail::angle_between<T>(q0, q1, i);
      return;
    case JointType::kSpherical:
      v.template segment<3>(k) = detail::rotation_between<T>(q0, q1, i);
      return;
    case JointType::kPlanar: {
      const T w = detail::angle_between<T>(q0, q1, i + 2), z = w * w;
      const T along = T(1) - z * inverse_jacobian_coefficient(z), across = w * T(0.5);
      const T dx = q1[i] - q0[i], dy = q1[i + 1] - q0[i + 1];
      const auto [c, s] = detail::direction<T>(q0[i + 2], q0[i + 3]);
      const T x = c * dx + s * dy, y = c * dy - s * dx;
      v[k] = along * x + across * y;
      v[k + 1] = along * y - across * x;
      v[k + 2] = w;
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
  if (is_single(joint.type)) {
    d_q(joint.idx_v, joint.idx_v) = d_v(joint.idx_v, joint.idx_v) = T(1);
    return;
  }
  const Motion<T> xi = detail::joint_screw<T>(joint, v);
  detail::put_block(joint, action_matrix(inverse(exp(xi))), d_q);
  detail::put_block(joint, right_jacobian(xi), d_v);
}

// Tangent Jacobians of v = q1 (-) q0, with respect to q0 and to q1: -Jr(-v)^-1 and Jr(v)^-1.
template <class T>
void difference_jacobians(const Joint<T>& joint, const VectorRef<T>& v, MatrixX<T>& d_q0, MatrixX<T>& d_q1) {
  if (is_single(joint.type)) {
    d_q0(joint.idx_v, joint.idx_v) = T(-1);
    d_q1(joint.idx_v, joint.idx_v) = T(1);
    return;
  }
  const Motion<T> xi = detail::joint_screw<T>(joint, v);
  detail::put_block<T>(joint, -inverse_right_jacobian(Motion<T>{-xi.linear, -xi.angular}), d_q0);
  detail::put_block(joint, inverse_right_jacobian(xi), d_q1);
}

// The configuration in which X_J is the identity.
template <class T>
void neutral(const Joint<T>& joint, VectorX<T>& q) {
  const int i = joint.idx_q;
  q.segment(i, nq(joint.type)).setZero();
  if (joint.type == JointType::kContinuous) q[i] = T(1);
  if (joint.type == JointType::kPlanar) q[i + 2] = T(1);
  if (joint.type == JointType::kSpherical) q[i + 3] = T(1);
  if (joint.type == JointType::kFreeFlyer) q[i + 6] = T(1);
}

// Uniform between the limits; without limits in [-pi, pi] (rad) or [-1, 1] (m); rotations uniform.
template <class T>
void random_configuration(const Joint<T>& joint, std::mt19937_64& random, VectorX<T>& q) {
  const int i = joint.idx_q;
  const auto uniform = [&](double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  constexpr double kPi = 3.14159265358979323846;
  const auto turn_anywhere = [&](int at) {
    const double angle = uniform(-kPi, kPi);
    q[at] = T(std::cos(angle));
    q[at + 1] = T(std::sin(angle));
  };
  // Shoemake: two random circles, weighted so that the quaternion is uniform on the sphere.
  const auto rotate_anywhere = [&](int at) {
    const double u = uniform(0, 1), a = uniform(-kPi, kPi), b = uniform(-kPi, kPi);
    q[at] = T(std::sqrt(1 - u) * std::sin(a));
    q[at + 1] = T(std::sqrt(1 - u) * std::cos(a));
    q[at + 2] = T(std::sqrt(u) * std::sin(b));
    q[at + 3] = T(std::sqrt(u) * std::cos(b));
  };
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kPrismatic:
    case JointType::kHelical: {
      const double range = joint.type == JointType::kPrismatic ? 1 : kPi;
      double lower = joint.limits.lower, upper = joint.limits.upper;
      if (!std::isfinite(lower)) lower = std::isfinite(upper) ? upper - 2 * range : -range;
      if (!std::isfinite(upper)) upper = lower + 2 * range;
      q[i] = T(uniform(lower, upper));
      return;
    }
    case JointType::kContinuous:
      turn_anywhere(i);
      return;
    case JointType::kSpherical:
      rotate_anywhere(i);
      return;
    case JointType::kPlanar:
      for (int k = 0; k < 2; ++k) q[i + k] = T(uniform(-1, 1));
      turn_anywhere(i + 2);
      return;
    case JointType::kFreeFlyer:
      for (int k = 0; k < 3; ++k) q[i + k] = T(uniform(-1, 1));
      rotate_anywhere(i + 3);
  }
}

}  // namespace dyntape::dynamics
