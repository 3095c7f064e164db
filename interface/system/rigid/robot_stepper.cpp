// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/rigid/robot_stepper.h>

namespace dyntape {

using Eigen::VectorXd;

namespace {

bool has_rigid_jacobians(const RobotScene& robot, Integrator integrator) {
  return !robot.constraints.rigid.empty() && RigidStepper::needs_jacobians(integrator);
}

}  // namespace

Stepper RobotStepper::stepper_of(const Setting& s) {
  const System system = s.edit ? system_of(s.robot, s.n_p, s.edit) : system_of(s.robot);
  return Stepper(system, s.integrator, s.options, has_rigid_jacobians(s.robot, s.integrator), 1,
                 s.tolerances);
}

RobotStepper::RobotStepper(const RobotScene& robot, Integrator integrator, const CodegenOptions& options,
                           const Tolerances& tolerances, int n_p, const SceneEdit& edit)
    : setting_{robot, integrator, options, tolerances, n_p, edit},
      stepper_(stepper_of(setting_)),
      next_(stepper_.nx()) {
  if (!robot.constraints.rigid.empty())
    rigid_.emplace(robot, stepper_, integrator, RigidFunctions(robot, options, n_p, edit));
}

RobotStepper::RobotStepper(const RobotStepper& other, Stepper stepper)
    : setting_(other.setting_), stepper_(std::move(stepper)), next_(stepper_.nx()) {
  if (other.rigid_)
    rigid_.emplace(setting_.robot, stepper_, setting_.integrator, RigidFunctions(other.rigid_->functions()));
}

std::unique_ptr<RobotStepper> RobotStepper::twin() const {
  const bool has_jacobians = has_rigid_jacobians(setting_.robot, setting_.integrator);
  return std::unique_ptr<RobotStepper>(
      new RobotStepper(*this, has_jacobians ? stepper_of(setting_) : stepper_.twin()));
}

void RobotStepper::start(const VectorXd& x, const VectorXd& p) {
  x_ = x, p_ = p;
  if (rigid_) rigid_->start(x, p);
}

bool RobotStepper::step(const StepTime& s, const VectorXd& u) {
  why_.clear();
  const bool done = rigid_ ? rigid_->step(s.t, s.h, x_, u, next_, &why_)
                           : stepper_.step(s.t, s.h, x_.data(), u.data(), p_.data(), next_.data(), &why_);
  if (!done) return false;
  if (next_.squaredNorm() < kBeyond) return true;
  why_ = kUnbounded;
  return false;
}

VectorXd RobotStepper::parameters() const {
  if (!rigid_) return p_;
  VectorXd all(p_.size() + rigid_->forces().size());
  all << p_, rigid_->forces();
  return all;
}

}  // namespace dyntape
