// SPDX-License-Identifier: BSD-3-Clause
//
// Observers of a motion (run.h): its energy balance, and how deep rigid contacts and stops are passed.
//
//   EnergyAccount account(scene, meter.layout());
//   MotionAccount of_motion(scene, meter, motion, account);       // motion: a RobotStepper of the scene
//   PenetrationCheck depth(scene.robot, motion);
//   of_motion.start(u), depth.reached(0);
//   run(motion, range, inputs, of_motion, depth);
//   account.finish(), depth.warning()
//
// The work of each step is that of MotionWork (step_work.h), with rigid contacts that of RigidAccount.
#pragma once

#include <optional>

#include <dyntape/interface/run/simulate/rigid_account.h>
#include <dyntape/interface/system/rigid/robot_stepper.h>

namespace dyntape {

class MotionAccount {
 public:
  // Keeps references.
  MotionAccount(const Scene& scene, EnergyMeter& meter, RobotStepper& motion, EnergyAccount& account);

  void start(const Eigen::VectorXd& u);  // at the state of the motion
  void before(const StepTime& s, const Eigen::VectorXd& u);
  void after(const StepTime& s, const Eigen::VectorXd& u);
  void reached(long k);  // the meter's latest energies are then those of the state

  const RigidAccount* rigid() const { return rigid_ ? &*rigid_ : nullptr; }  // null: no contacts or stops

 private:
  EnergyMeter& meter_;
  RobotStepper& motion_;
  EnergyAccount& account_;
  std::optional<MotionWork> work_;     // without,
  std::optional<RigidAccount> rigid_;  // and with rigid contacts or stops
  Eigen::VectorXd u_;
  Eigen::MatrixXd of_step_;  // J
};

class PenetrationCheck {
 public:
  // Keeps references.  A contact or stop may be passed by a thousandth of the robot's length; of a joint that turns,
  // by 1e-3 rad.
  PenetrationCheck(const RobotScene& robot, RobotStepper& motion, double step);

  void reached(long k);

  double deepest() const { return deepest_; }              // m or rad
  const std::string& warning() const { return warning_; }  // "", or the first that was passed by more

 private:
  const RobotScene& robot_;
  RobotStepper& motion_;
  double step_, deepest_ = 0;
  Eigen::VectorXd most_;
  std::string warning_;
};

}  // namespace dyntape
