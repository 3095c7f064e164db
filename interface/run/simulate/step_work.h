// SPDX-License-Identifier: BSD-3-Clause
//
// The work of all that acts over a step, with what the motors are told held as the step holds it.
//
//   StepWork work(scene, energy_meter);
//   work.between({begin, middle, end}, u, h)      // (flows + 1, mechanisms) J, last what is released of what is stored
//   work.put_motors({begin, middle, end}, u, h, sum)      // into Simpson's sum of all powers
//
// By Simpson's rule, but for motors: a torque that is held does tau . dq exactly, and one that follows its command with a lag
//   int (u + (m - u) exp(-s / lag)) v ds,     v the parabola through beginning, middle and end, exactly.
#pragma once

#include <dyntape/interface/run/simulate/energy_account.h>
#include <dyntape/interface/system/energy.h>

namespace dyntape {

class StepWork {
 public:
  struct States {
    const Eigen::VectorXd &begin, &middle, &end;
  };

  StepWork(const Scene& scene, EnergyMeter& meter);

  Eigen::MatrixXd between(const States& x, const Eigen::VectorXd& u, double h, const Eigen::VectorXd& p = {});
  // In place of what the sum has of motors.
  void put_motors(const States& x, const Eigen::VectorXd& u, double h, Eigen::MatrixXd& sum) const;

 private:
  double of_motor(std::size_t k, const States& x, const Eigen::VectorXd& moved, double u, double h) const;

  struct Motor {
    int dof, mechanism;
    double lag;         // s, 0: none
    Eigen::Index in_x;  // where its torque is, with a lag
  };
  const Scene& scene_;
  EnergyMeter& meter_;
  std::vector<Motor> motors_;
};

// The work of each step of a motion, by the rule of its scene (energy_account.h).
//
//   MotionWork work(scene, energy_meter, stepper);
//   work.before_step(u); stepper.step(...); const MatrixXd& of_step = work.after_step(t, x, next);
class MotionWork {
 public:
  // Keeps references; while it is there, the stepper of an adaptive scheme tells it of its internal steps.
  MotionWork(const Scene& scene, EnergyMeter& meter, Stepper& stepper);
  ~MotionWork() { stepper_.watch({}); }
  MotionWork(const MotionWork&) = delete;
  MotionWork& operator=(const MotionWork&) = delete;

  void before_step(const Eigen::VectorXd& u, const Eigen::VectorXd& p = {});
  const Eigen::MatrixXd& after_step(double t, const Eigen::VectorXd& x, const Eigen::VectorXd& next);

 private:
  const Scene& scene_;
  Stepper& stepper_;
  StepWork of_steps_;
  Eigen::VectorXd u_, p_, middle_;
  Eigen::MatrixXd of_step_;
};

// int_0^1 x^n exp(-z x) dx for n = 0, 1, 2; z >= 0.
Eigen::Vector3d moments_of_decay(double z);

}  // namespace dyntape
