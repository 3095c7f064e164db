// SPDX-License-Identifier: BSD-3-Clause
//
// A second opinion on dynamics, kept apart from the library's algorithms so that an error in one shows.
//
//   Eigen::VectorXd tau = reference::inverse_dynamics(model, q, v, a);
//
// Newton and Euler in the world frame, body by body, with dense vectors: slow and plain.
//   body k:  f = m (c_dd - g),  n = I w_d + w x I w about its centre of mass c
//   tau_j  = sum over bodies k beyond j of the power of f_k, n_k on the velocity that joint j alone gives
#pragma once

#include <dyntape/dynamics/model/model.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <random>
#include <vector>

namespace dyntape::dynamics::reference {

using Matrix3d = Matrix3<double>;
using Eigen::MatrixXd;
using Vector3d = Vector3<double>;
using Eigen::VectorXd;

// Motion of a body frame in the world: placement, velocity and acceleration of its origin, angular too.
struct BodyState {
  Matrix3d R = Matrix3d::Identity();
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero(), a = Vector3d::Zero();
  Vector3d w = Vector3d::Zero(), wd = Vector3d::Zero();

  Vector3d position(const Vector3d& r) const { return p + R * r; }
  Vector3d velocity(const Vector3d& r) const { return v + w.cross(R * r); }
  Vector3d acceleration(const Vector3d& r) const { return a + wd.cross(R * r) + w.cross(w.cross(R * r)); }
};

// Moving side of a joint in its fixed side, for its own entries of q.
inline Placement<double> joint_pose(const Joint<double>& joint, const VectorXd& q) {
  const auto about = [&](double angle) { return Eigen::AngleAxisd(angle, joint.axis).toRotationMatrix(); };
  const auto quaternion = [&](long i) {
    return Eigen::Quaterniond(q[i + 3], q[i], q[i + 1], q[i + 2]).toRotationMatrix();
  };
  switch (joint.type) {
    case JointType::kRevolute:
      return {about(q[0]), Vector3d::Zero()};
    case JointType::kContinuous:
      return {about(std::atan2(q[1], q[0])), Vector3d::Zero()};
    case JointType::kPrismatic:
      return {Matrix3d::Identity(), joint.axis * q[0]};
    case JointType::kHelical:
      return {about(q[0]), joint.axis * (joint.pitch * q[0])};
    case JointType::kSpherical:
      return {quaternion(0), Vector3d::Zero()};
    case JointType::kPlanar:
      return {Eigen::AngleAxisd(std::atan2(q[3], q[2]), Vector3d::UnitZ()).toRotationMatrix(),
              Vector3d(q[0], q[1], 0)};
    case JointType::kFreeFlyer:
      break;
  }
  return {quaternion(3), q.head<3>()};
}

// Velocity of the moving side against the fixed side, in the moving frame, for its own entries of v.
inline Motion<double> joint_velocity(const Joint<double>& joint, const VectorXd& v) {
  switch (joint.type) {
    case JointType::kRevolute:
    case JointType::kContinuous:
      return {Vector3d::Zero(), joint.axis * v[0]};
    case JointType::kPrismatic:
      return {joint.axis * v[0], Vector3d::Zero()};
    case JointType::kHelical:
      return {joint.axis * (joint.pitch * v[0]), joint.axis * v[0]};
    case JointType::kSpherical:
      return {Vector3d::Zero(), v};
    case JointType::kPlanar:
      return {Vector3d(v[0], v[1], 0), Vector3d(0, 0, v[2])};
    case JointType::kFreeFlyer:
      break;
  }
  return {v.head<3>(), v.tail<3>()};
}

inline BodyState step(const BodyState& parent, const Joint<double>& joint, const Placement<double>& X,
                      const VectorXd& q, const VectorXd& v, const VectorXd& a) {
  const Placement<double> own = joint_pose(joint, q);
  const Motion<double> rate = joint_velocity(joint, v), faster = joint_velocity(joint, a);
  BodyState s{parent.R * X.R * own.R,
              parent.position(X.p),
              parent.velocity(X.p),
              parent.acceleration(X.p),
              parent.w,
              parent.wd};
  const Vector3d r = parent.R * X.R * own.p, u = s.R * rate.linear, spin = s.R * rate.angular;
  s.p += r;
  s.v += parent.w.cross(r) + u;
  s.a += parent.wd.cross(r) + parent.w.cross(parent.w.cross(r)) + 2 * parent.w.cross(u) +
         s.R * (faster.linear + rate.angular.cross(rate.linear));
  s.w += spin;
  s.wd += s.R * faster.angular + parent.w.cross(spin);
  return s;
}

inline std::vector<BodyState> body_states(const Model<double>& m, const VectorXd& q, const VectorXd& v,
                                          const VectorXd& a) {
  std::vector<BodyState> states;
  for (int i = 0; i < m.njoints(); ++i) {
    const Joint<double>& j = m.joints[i];
    const BodyState parent = m.parent[i] < 0 ? BodyState{} : states[m.parent[i]];
    states.push_back(step(parent, j, m.X_PJ[i], q.segment(j.idx_q, nq(j.type)),
                          v.segment(j.idx_v, nv(j.type)), a.segment(j.idx_v, nv(j.type))));
  }
  return states;
}

inline VectorXd inverse_dynamics(const Model<double>& m, const VectorXd& q, const VectorXd& v,
                                 const VectorXd& a) {
  const std::vector<BodyState> states = body_states(m, q, v, a);
  VectorXd tau = VectorXd::Zero(m.nv);
  for (int k = 0; k < m.njoints(); ++k) {
    const BodyState& body = states[k];
    const Inertia<double>& I = m.inertias[k];
    const Matrix3d I_world = body.R * I.I_c * body.R.transpose();
    const Vector3d f = I.mass * (body.acceleration(I.com) - m.gravity);
    const Vector3d n = I_world * body.wd + body.w.cross(I_world * body.w);
    for (int j = k; j >= 0; j = m.parent[j]) {
      const Joint<double>& joint = m.joints[j];
      const Vector3d moment = n + (body.position(I.com) - states[j].p).cross(f);
      const int n = nv(joint.type);
      for (int c = 0; c < n; ++c) {
        const Motion<double> unit = joint_velocity(joint, VectorXd::Unit(n, c));
        tau[joint.idx_v + c] += (states[j].R * unit.linear).dot(f) + (states[j].R * unit.angular).dot(moment);
      }
    }
  }
  return tau;
}

inline MatrixXd mass_matrix(const Model<double>& m, const VectorXd& q) {
  Model<double> weightless = m;
  weightless.gravity.setZero();
  MatrixXd M(m.nv, m.nv);
  for (int i = 0; i < m.nv; ++i)
    M.col(i) = inverse_dynamics(weightless, q, VectorXd::Zero(m.nv), VectorXd::Unit(m.nv, i));
  return M;
}

inline VectorXd forward_dynamics(const Model<double>& m, const VectorXd& q, const VectorXd& v,
                                 const VectorXd& tau) {
  return mass_matrix(m, q).ldlt().solve(tau - inverse_dynamics(m, q, v, VectorXd::Zero(m.nv)));
}

// Uniform entries in [-1, 1]; unit quaternions and (cos, sin) pairs.
inline VectorXd random_configuration(const Model<double>& m, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  VectorXd q(m.nq);
  for (double& x : q) x = number(random);
  for (const Joint<double>& j : m.joints) {
    if (j.type == JointType::kFreeFlyer) q.segment<4>(j.idx_q + 3).normalize();
    if (j.type == JointType::kSpherical) q.segment<4>(j.idx_q).normalize();
    if (j.type == JointType::kContinuous) q.segment<2>(j.idx_q).normalize();
    if (j.type == JointType::kPlanar) q.segment<2>(j.idx_q + 2).normalize();
  }
  return q;
}

inline VectorXd random_vector(int size, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  VectorXd x(size);
  for (double& entry : x) entry = number(random);
  return x;
}

}  // namespace dyntape::dynamics::reference
