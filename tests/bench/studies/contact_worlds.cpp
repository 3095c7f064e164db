// SPDX-License-Identifier: BSD-3-Clause
#include "contact_worlds.h"

#include <chrono>
#include <cmath>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>

namespace dyntape::tools {
namespace {

using Eigen::VectorXd;

constexpr const char* kFeet[] = {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"};
constexpr double kFootRadius = 0.016;  // m

std::string corner(int k) { return "corner_" + std::to_string(k + 1); }

RobotScene robot(const std::string& config, const std::string& urdf) {
  RobotScene scene;
  scene.model = dynamics::load_urdf(config + "/robots/" + urdf, {.base = dynamics::Base::kFloating});
  return scene;
}

}  // namespace

VectorXd BlockValues::parameters() const {
  VectorXd p(5);
  p << gravity * std::sin(tilt), -gravity * std::cos(tilt), stiffness, dissipation, friction;
  return p;
}

double block_pitch_frequency(double stiffness) {
  const double arm = 0.15, inertia = kMass * (0.3 * 0.3 + 0.1 * 0.1) / 12;
  return std::sqrt(4 * stiffness * arm * arm / inertia);
}

ContactWorld compliant_block(const std::string& config) {
  ContactWorld world{robot(config, "box.urdf"), {}, 4};
  world.scene.effects.contacts.slip = kSlip;
  for (int k = 0; k < world.feet; ++k) {
    dynamics::ContactBody<double> body;
    dynamics::place_at_frame(world.scene.model, corner(k), body);
    body.exponent = dynamics::ContactExponent::kOne, body.stiffness = 1, body.dissipation = 1,
    body.friction = 1;
    world.scene.effects.contacts.push_back(body);
  }
  world.scene.actuated = {};
  world.system = system_of(world.scene, 5, [](RecordedScene& scene, const VectorXad& p) {
    scene.effects.gravity.vector = dynamics::Vector3<AD>(p[0], AD(0), p[1]);
    for (auto& body : scene.effects.contacts)
      body.stiffness = p[2], body.dissipation = p[3], body.friction = p[4];
  });
  return world;
}

ContactWorld rigid_block(const std::string& config, const BlockValues& values, double restitution) {
  ContactWorld world{robot(config, "box.urdf"), {}, 4};
  const VectorXd p = values.parameters();
  world.scene.model.gravity = {p[0], 0, p[1]};
  for (int k = 0; k < world.feet; ++k) {
    dynamics::RigidContact body{.name = corner(k), .friction = values.friction, .restitution = restitution};
    dynamics::place_at_frame(world.scene.model, body.name, body);
    world.scene.constraints.rigid.contacts.push_back(body);
  }
  world.system = system_of(world.scene);
  return world;
}

ContactWorld quadruped(const std::string& config, bool is_rigid) {
  ContactWorld world{robot(config, "solo12.urdf"), {}, 4};
  RobotScene& scene = world.scene;
  const int nv = scene.model.nv;
  const auto at_joints = [nv](double value) {
    VectorXd all = VectorXd::Zero(nv);
    all.tail(nv - 6).setConstant(value);
    return all;
  };
  scene.effects.damping = at_joints(0.05);
  scene.effects.armature = at_joints(4.2e-5 * 81);
  scene.effects.springs =
      dynamics::Springs<double>{at_joints(8), quadruped_touching(world).head(scene.model.nq)};
  for (const char* foot : kFeet) {
    if (is_rigid) {
      dynamics::RigidContact body{.name = foot, .radius = kFootRadius, .friction = 0.7};
      dynamics::place_at_frame(scene.model, foot, body);
      scene.constraints.rigid.contacts.push_back(body);
      continue;
    }
    dynamics::ContactBody<double> body;
    dynamics::place_at_frame(scene.model, foot, body);
    body.radius = kFootRadius, body.stiffness = kFootStiffness, body.dissipation = 1, body.friction = 0.7;
    scene.effects.contacts.push_back(body);
  }
  world.system = system_of(scene);
  return world;
}

VectorXd block_at(double height) {
  VectorXd x = VectorXd::Zero(13);
  x[2] = height, x[6] = 1;
  return x;
}

VectorXd quadruped_touching(const ContactWorld& world) {
  const auto& model = world.scene.model;
  VectorXd x = VectorXd::Zero(model.nq + model.nv);
  x.head(model.nq) = dynamics::neutral(model);
  for (int leg = 0; leg < 4; ++leg)
    x.segment<3>(7 + 3 * leg) << 0, leg < 2 ? 0.8 : -0.8, leg < 2 ? -1.6 : 1.6;
  x[2] = foot_depths(world, x).maxCoeff() + 1e-9;
  return x;
}

VectorXd foot_depths(const ContactWorld& world, const VectorXd& x) {
  const auto& model = world.scene.model;
  dynamics::Data<double> data(model);
  const VectorXd q = x.head(model.nq);
  dynamics::forward_kinematics<double>(model, data, q);
  VectorXd depths(4);
  for (int k = 0; k < 4; ++k) {
    const auto& frame = model.frames[std::size_t(model.frame_index(kFeet[k]))];
    const auto& X = data.X_WB[std::size_t(frame.body)];
    depths[k] = kFootRadius - (X.R * frame.X_BF.p + X.p)[2];
  }
  return depths;
}

double weight(const ContactWorld& world) {
  double mass = 0;
  for (const auto& inertia : world.scene.model.inertias) mass += inertia.mass;
  return mass * world.scene.model.gravity.norm();
}

Eigen::Vector3d block_velocity(const VectorXd& x) {
  return Eigen::Quaterniond(x[6], x[3], x[4], x[5]) * Eigen::Vector3d(x.segment<3>(7));
}

Mover::Mover(const ContactWorld& world, Integrator integrator, double relative_tolerance)
    : world_(world),
      stepper_(world.system, integrator, {},
               !world.scene.constraints.rigid.empty() && RigidStepper::needs_jacobians(integrator), 1,
               {.relative = relative_tolerance, .absolute = relative_tolerance * 1e-3}) {
  if (!world.scene.constraints.rigid.empty())
    rigid_.emplace(world.scene, stepper_, integrator, CodegenOptions{});
}

Moved Mover::run(VectorXd x, double step, long steps, const VectorXd& p) {
  Moved moved;
  const VectorXd u = VectorXd::Zero(stepper_.n_u());
  VectorXd next(x.size());
  const auto begin = std::chrono::steady_clock::now();
  if (rigid_) rigid_->start(x);
  for (long k = 0; k < steps; ++k) {
    const double t = double(k) * step;
    const bool done = rigid_
                          ? rigid_->step(t, step, x, u, next, &moved.trouble)
                          : stepper_.step(t, step, x.data(), u.data(), p.data(), next.data(), &moved.trouble);
    if (!done) break;
    x.swap(next);
  }
  moved.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  moved.x = x;
  if (rigid_) {
    const auto blocks = dynamics::blocks_of(world_.scene.constraints.rigid);
    Eigen::Index row = 0;
    for (const auto& block : blocks) moved.pushed += rigid_->forces()[row], row += block.rows;
  }
  return moved;
}

}  // namespace dyntape::tools
