// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/motion_account.h>

#include <algorithm>

#include <dyntape/interface/io/number.h>

namespace dyntape {

using Eigen::VectorXd;

namespace {

// How far rigid contacts and stops may be passed: a thousandth of the robot's length, of joints that turn 1e-3 rad.
VectorXd most_penetrations(const RobotScene& scene) {
  constexpr double kShare = 1e-3;
  double length = 0, reach = 0;
  for (const auto& placement : scene.model.X_PJ) length += placement.p.norm();
  for (const auto& contact : scene.constraints.rigid.contacts)
    reach = std::max(reach, contact.X_BF.p.norm() + contact.radius);
  VectorXd most = VectorXd::Constant(Eigen::Index(scene.constraints.rigid.size()), kShare * (length + reach));
  Eigen::Index row = Eigen::Index(scene.constraints.rigid.contacts.size());
  for (const auto& stop : scene.constraints.rigid.stops) {
    for (const auto& joint : scene.model.joints) {
      if (joint.idx_v == stop.idx_v && dynamics::traits(joint.type).has_angle) most[row] = kShare;
    }
    ++row;
  }
  return most;
}

}  // namespace

MotionAccount::MotionAccount(const Scene& scene, EnergyMeter& meter, RobotStepper& motion,
                             EnergyAccount& account)
    : meter_(meter), motion_(motion), account_(account) {
  if (motion.rigid())
    rigid_.emplace(scene, meter);
  else
    work_.emplace(scene, meter, motion.stepper());
}

void MotionAccount::start(const VectorXd& u) {
  const Energy& energy = meter_.at(motion_.x(), u, motion_.p());
  if (rigid_)
    account_.reach(energy, rigid_->work());
  else
    account_.start(energy);
}

void MotionAccount::before(const StepTime&, const VectorXd& u) {
  u_ = u;
  if (work_) work_->before_step(u, motion_.p());
}

void MotionAccount::after(const StepTime& s, const VectorXd& u) {
  if (rigid_)
    rigid_->add(*motion_.rigid(), u, s.h, motion_.p());
  else
    of_step_ = work_->after_step(s.t, motion_.x(), motion_.next());
}

void MotionAccount::reached(long) {
  const Energy& energy = meter_.at(motion_.x(), u_, motion_.p());
  if (rigid_)
    account_.reach(energy, rigid_->work());
  else
    account_.add(energy, of_step_);
}

PenetrationCheck::PenetrationCheck(const RobotScene& robot, RobotStepper& motion, double step)
    : robot_(robot), motion_(motion), step_(step) {
  if (motion.rigid()) most_ = most_penetrations(robot);
}

void PenetrationCheck::reached(long k) {
  if (!motion_.rigid()) return;
  const VectorXd& gap = motion_.rigid()->functions().near(motion_.x()).gap;
  deepest_ = std::max(deepest_, -gap.minCoeff());
  for (Eigen::Index i = 0; i < gap.size() && warning_.empty(); ++i) {
    if (!(-gap[i] > most_[i])) continue;
    warning_ = "at t = " + io::with_digits(double(k) * step_, 6) + " s " +
               depth_text(robot_.constraints.rigid, std::size_t(i), -gap[i], 2) + ", more than " +
               io::with_digits(most_[i], 2) + "; take shorter steps";
  }
}

}  // namespace dyntape
