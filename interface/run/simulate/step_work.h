// SPDX-License-Identifier: BSD-3-Clause
//
// The work over a step of all forces without a potential; commands of motors are held as the step holds them.
//
//   StepWork work(scene, energy_meter);
//   work.between({begin, middle, end}, u, h)      // (flows, mechanisms) J, by the rule of the scene (energy_account.h)
//   work.put_motors({begin, middle, end}, u, h, sum)      // into Simpson's sum of all powers
//
// Schemes with one evaluation of the forces f a step change the momenta by h f: the work is h f along a velocity w.
//   semi-implicit-euler   f at (q, v)                     w = (v + v') / 2
//   implicit-velocity     f at (q', v')                   w = (v + v') / 2
//   implicit-midpoint,    f at (q (+) xi / 2, xi / h)     w = xi / h,   xi = q' (-) q
//   variational
// Other steps use Simpson's rule, except for motors.  A held torque does tau . dq exactly; a torque that follows its
// command with a lag does
//   int (u + (m - u) exp(-s / lag)) v ds,     v the parabola through beginning, middle and end, exactly.
#pragma once

#include <dyntape/interface/run/simulate/energy_account.h>
#include <dyntape/interface/system/energy.h>

namespace dyntape {

class StepWork {
 public:
  struct States {
    const Eigen::VectorXd &begin, &middle, &end;  // schemes with one evaluation do not read the middle
  };
  // The place at which such a scheme evaluates the forces of a step, and w.
  struct Stage {
    Eigen::VectorXd x, along;
  };

  StepWork(const Scene& scene, EnergyMeter& meter);

  Eigen::MatrixXd between(const States& x, const Eigen::VectorXd& u, double h, const Eigen::VectorXd& p = {});
  bool has_stage() const { return has_stage_; }
  Stage stage_of(const Eigen::VectorXd& begin, const Eigen::VectorXd& end, const Eigen::VectorXd& u,
                 double h) const;
  // Replaces the part of motors in the sum.
  void put_motors(const States& x, const Eigen::VectorXd& u, double h, Eigen::MatrixXd& sum) const;

 private:
  double of_motor(std::size_t k, const States& x, const Eigen::VectorXd& moved, double u, double h) const;

  struct Motor {
    int dof, mechanism;
    double lag;         // s, 0: none
    Eigen::Index in_x;  // index of its torque in x, with a lag
  };
  const Scene& scene_;
  EnergyMeter& meter_;
  bool has_stage_;
  std::vector<Motor> motors_;
};

// The work of each step of a motion, by the rule of its scene (energy_account.h).
//
//   MotionWork work(scene, energy_meter, stepper);
//   work.before_step(u); stepper.step(...); const MatrixXd& of_step = work.after_step(t, x, next);
class MotionWork {
 public:
  // Keeps references.  During its life, the stepper of an adaptive scheme reports its internal steps to it.
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
