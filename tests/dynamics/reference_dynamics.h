// SPDX-License-Identifier: BSD-3-Clause
//
// A second opinion on dynamics, kept apart from the library's algorithms so that an error in one shows.
//
//   Eigen::VectorXd tau = reference::inverse_dynamics(model, q, v, a);
//
// Newton and Euler in the world frame, body by body, with dense vectors: slow and plain.
//   body k:  f = m (c_dd - g),  n = I w_d + w x I w about its centre of mass c
//   tau_j  = sum over bodies k beyond j of  axis_j . (n_k + (c_k - o_j) x f_k)   (revolute; prismatic: axis_j
//   . f_k)
// The free-flyer's rows are force and moment in the base frame, about its origin.
#pragma once

#include <dyntape/dynamics/model.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <random>
#include <vector>

namespace dyntape::dynamics::reference {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
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

inline BodyState step(const BodyState& parent, const Joint<double>& joint, const Placement<double>& X,
                      VectorXd q, VectorXd v, VectorXd a) {
  BodyState s;
  const Matrix3d R = parent.R * X.R;
  const Vector3d axis = R * joint.axis;
  s = {R, parent.position(X.p), parent.velocity(X.p), parent.acceleration(X.p), parent.w, parent.wd};
  if (joint.type == JointType::kFreeFlyer) {
    s.R = R * Eigen::Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix();
    s.p += R * q.head<3>();
    s.v = s.R * v.head<3>();
    s.w = s.R * v.tail<3>();
    s.wd = s.R * a.tail<3>();
    s.a = s.R * (a.head<3>() + Vector3d(v.tail<3>()).cross(Vector3d(v.head<3>())));
  } else if (joint.type == JointType::kPrismatic) {
    const Vector3d r = axis * q[0];
    s.p += r;
    s.v += parent.w.cross(r) + axis * v[0];
    s.a += parent.wd.cross(r) + parent.w.cross(parent.w.cross(r)) + 2 * parent.w.cross(axis) * v[0] +
           axis * a[0];
  } else {
    const double angle = joint.type == JointType::kContinuous ? std::atan2(q[1], q[0]) : q[0];
    s.R = R * Eigen::AngleAxisd(angle, joint.axis).toRotationMatrix();
    s.w += axis * v[0];
    s.wd += axis * a[0] + parent.w.cross(axis * v[0]);
  }
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
      const Vector3d axis = states[j].R * joint.axis;
      if (joint.type == JointType::kFreeFlyer) {
        tau.segment<3>(joint.idx_v) += states[j].R.transpose() * f;
        tau.segment<3>(joint.idx_v + 3) += states[j].R.transpose() * moment;
      } else {
        tau[joint.idx_v] += axis.dot(joint.type == JointType::kPrismatic ? f : moment);
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
    if (j.type == JointType::kContinuous) q.segment<2>(j.idx_q).normalize();
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
