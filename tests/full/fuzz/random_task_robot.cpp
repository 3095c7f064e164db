// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "full/solves/segments.h"
#include "random_task.h"

namespace dyntape::testing {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

Isometry3d isometry(const dynamics::Placement<double>& X) {
  Isometry3d result = Isometry3d::Identity();
  result.linear() = X.R, result.translation() = X.p;
  return result;
}

Eigen::Quaterniond turn_of(const VectorXd& q) { return Eigen::Quaterniond(q[6], q[3], q[4], q[5]); }

}  // namespace

Isometry3d RobotAlone::pose(const VectorXd& q, const std::string& frame) const {
  Isometry3d X = Isometry3d::Identity();
  if (frame == kWorld) return X;
  const auto& model = task_.model;
  const auto& at = model.frames[std::size_t(model.frame_index(frame))];
  X = isometry(at.X_BF);
  for (int i = at.body; i >= 0; i = model.parent[std::size_t(i)]) {
    const auto& joint = model.joints[std::size_t(i)];
    Isometry3d moved = Isometry3d::Identity();
    const double at_joint = q[joint.idx_q];
    if (joint.type == dynamics::JointType::kPrismatic) {
      moved.translation() = at_joint * joint.axis;
    } else if (joint.type == dynamics::JointType::kRevolute) {
      moved.linear() = Eigen::AngleAxisd(at_joint, joint.axis).toRotationMatrix();
    } else {
      moved.translation() = q.head<3>(), moved.linear() = turn_of(q).normalized().toRotationMatrix();
    }
    X = isometry(model.X_PJ[std::size_t(i)]) * moved * X;
  }
  return X;
}

double RobotAlone::gap(const VectorXd& q, const Capsule& a, const Capsule& b) const {
  const Isometry3d A = pose(q, a.frame), B = pose(q, b.frame);
  return least_distance({A * a.from, A * a.to}, {B * b.from, B * b.to}) - a.radius - b.radius;
}

double RobotAlone::least_gap(const VectorXd& q) const {
  double least = HUGE_VAL;
  for (const Capsule& body : task_.bodies) {
    for (const Capsule& obstacle : task_.obstacles) least = std::min(least, gap(q, body, obstacle));
  }
  return least;
}

VectorXd RobotAlone::acceleration(const VectorXd& x, const VectorXd& u) {
  const auto& model = task_.model;
  const VectorXd q = x.head(model.nq), v = x.tail(model.nv);
  VectorXd tau = VectorXd::Zero(model.nv);
  for (std::size_t k = 0; k < task_.driven.size(); ++k) tau[task_.driven[k]] += u[Eigen::Index(k)];
  for (std::size_t k = 0; k < task_.rotors.size(); ++k) {  // of a base that is the only body
    const auto& at = model.frames[std::size_t(model.frame_index(task_.rotors[k]))].X_BF;
    const Vector3d axis = at.R.col(2), force = u[Eigen::Index(task_.driven.size() + k)] * axis;
    tau.head<3>() += force;
    tau.segment<3>(3) += at.p.cross(force) + task_.moments[k] * force;
  }
  if (task_.is_damped) {
    for (const auto& joint : model.joints) tau[joint.idx_v] -= joint.damping * v[joint.idx_v];
  }
  return dynamics::aba<double>(model, data_, q, v, tau);
}

VectorXd RobotAlone::rate(const VectorXd& x, const VectorXd& u) {
  const auto& model = task_.model;
  VectorXd dx(x.size());
  dx.tail(model.nv) = acceleration(x, u);
  if (!task_.floats()) {
    dx.head(model.nq) = x.tail(model.nv);
    return dx;
  }
  const Eigen::Quaterniond turn = turn_of(x);
  const Vector3d w = x.tail<3>();
  const Eigen::Quaterniond spin = turn * Eigen::Quaterniond(0, w[0], w[1], w[2]);
  dx.head<3>() = turn.normalized() * x.segment<3>(model.nq);
  dx.segment<4>(3) << spin.x() / 2, spin.y() / 2, spin.z() / 2, spin.w() / 2;
  // A motion's states are quaternions that return to length one at this rate (interface/motion/robot_configuration.h).
  dx.segment<4>(3) += (1 - x.segment<4>(3).squaredNorm()) * x.segment<4>(3);
  return dx;
}

}  // namespace dyntape::testing
