// SPDX-License-Identifier: BSD-3-Clause
//
// Systems whose motions are known, for tests of steps.
#pragma once

#include <gtest/gtest.h>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/system/steps/stepper.h>

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "interface/interpreted.h"

namespace dyntape::test {

using Eigen::VectorXd;
inline constexpr double kGravity = 9.81;

inline dynamics::Joint<double> joint(dynamics::JointType type, const Eigen::Vector3d& axis,
                                     const std::string& name) {
  dynamics::Joint<double> j;
  j.name = name;
  j.type = type;
  j.axis = axis;
  return j;
}

inline dynamics::Inertia<double> point_mass(double mass, const Eigen::Vector3d& at) {
  return {mass, at, Eigen::Matrix3d::Zero()};
}

// M a = tau - h: the robot with torques that the point says, and its Lagrangian.
using Torques = std::function<VectorXad(const SystemPoint<AD>&)>;
inline System robot_system(const dynamics::Model<double>& model, const Torques& torques, int n_u = 0,
                           int n_p = 0) {
  System s{model.name, model, n_u, n_p};
  s.acceleration = [model, torques](const SystemPoint<AD>& at) -> VectorXad {
    const dynamics::Model<AD> taped = model.cast<AD>();
    dynamics::Data<AD> data(taped);
    return dynamics::aba<AD>(taped, data, at.q, at.v, torques(at));
  };
  s.lagrangian = [model](const VectorXad& q, const VectorXad& v, const VectorXad&) {
    const dynamics::Model<AD> taped = model.cast<AD>();
    dynamics::Data<AD> data(taped);
    return dynamics::kinetic_energy<AD>(taped, data, q, v) - dynamics::potential_energy<AD>(taped, data, q);
  };
  s.forces = torques;
  return s;
}

inline VectorXad no_torques(const SystemPoint<AD>& at) { return VectorXad::Constant(at.v.size(), AD(0)); }

// th'' = -9.81 sin th, by hand.
inline System pendulum() {
  System s{"pendulum"};
  s.model.add_joint(-1, joint(dynamics::JointType::kRevolute, {0, 1, 0}, "th"), {},
                    point_mass(1, {0, 0, -1}));
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, -kGravity * sin(at.q[0])));
  };
  s.lagrangian = [](const VectorXad& q, const VectorXad& v, const VectorXad&) {
    return 0.5 * v[0] * v[0] + kGravity * cos(q[0]);
  };
  return s;
}

// Two point masses of 1 kg on massless rods of 1 m, hanging at q = 0.
inline dynamics::Model<double> double_pendulum() {
  dynamics::Model<double> m;
  m.name = "double pendulum";
  const Eigen::Vector3d y(0, 1, 0), end(0, 0, -1);
  m.add_joint(-1, joint(dynamics::JointType::kRevolute, y, "first"), {}, point_mass(1, end));
  m.add_joint(0, joint(dynamics::JointType::kRevolute, y, "second"), {Eigen::Matrix3d::Identity(), end},
              point_mass(1, end));
  return m;
}

// Without weight, I = diag(1, 2, 3).
inline dynamics::Model<double> free_body() {
  dynamics::Model<double> m;
  m.name = "free body";
  m.gravity.setZero();
  m.add_joint(-1, joint(dynamics::JointType::kFreeFlyer, {0, 0, 1}, "base"), {},
              {1, {0, 0, 0}, Eigen::Vector3d(1, 2, 3).asDiagonal()});
  return m;
}

// m x'' = -k x
inline System spring(double mass, double stiffness) {
  System s{"spring"};
  s.model.add_joint(-1, joint(dynamics::JointType::kPrismatic, {1, 0, 0}, "slider"), {},
                    point_mass(mass, {0, 0, 0}));
  s.acceleration = [=](const SystemPoint<AD>& at) { return VectorXad(at.q * AD(-stiffness / mass)); };
  s.lagrangian = [=](const VectorXad& q, const VectorXad& v, const VectorXad&) {
    return 0.5 * (mass * v[0] * v[0] - stiffness * q[0] * q[0]);
  };
  return s;
}

// A floating base with a joint of each other kind: torques of two motors, one with a lag, a time-dependent push,
// damping by a parameter and a load by another.
inline System walker() {
  using dynamics::JointType;
  dynamics::Model<double> m;
  m.name = "walker";
  const dynamics::Inertia<double> body{2, {0.1, -0.05, 0.2}, Eigen::Vector3d(0.5, 0.6, 0.7).asDiagonal()};
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  m.add_joint(-1, joint(JointType::kFreeFlyer, {0, 0, 1}, "base"), {}, body);
  m.add_joint(0, joint(JointType::kRevolute, {0, 1, 0}, "hip"), {one, {0.2, 0.1, 0}}, body);
  m.add_joint(0, joint(JointType::kContinuous, {1, 0, 0}, "wheel"), {one, {-0.2, 0.1, 0}}, body);
  m.add_joint(1, joint(JointType::kSpherical, {0, 0, 1}, "ball"), {one, {0, 0, -0.3}}, body);
  System s = robot_system(
      m,
      [](const SystemPoint<AD>& at) {
        VectorXad tau = at.v * (-at.p[0]);
        tau[6] += 3.0 * at.drive[0];
        tau[7] += 2.0 * at.drive[1];
        tau[8] += sin(5.0 * at.t) * at.p[1];
        return tau;
      },
      2, 2);
  s.lag = Eigen::Vector2d(0, 0.03);
  return s;
}

inline const std::vector<Integrator> kFixedIntegrators{
    Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4, Integrator::kImplicitMidpoint,
    Integrator::kImplicitVelocity, Integrator::kVariational};

// Steps of a system without commands and parameters, looked at after each.
template <class Look>
void run(Stepper& stepper, double h, int steps, VectorXd& x, const Look& look) {
  std::string why;
  for (int k = 0; k < steps; ++k) {
    if (!stepper.step(k * h, h, x.data(), nullptr, nullptr, x.data(), &why)) FAIL() << why;
    look(x);
  }
}

}  // namespace dyntape::test
