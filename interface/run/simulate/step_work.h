// SPDX-License-Identifier: BSD-3-Clause
//
// The work of all that acts over a step, with what the motors are told held as the step holds it.
//
//   StepWork work(scene, energy_meter);
//   work.between({begin, middle, end}, u, h)      // (flows + 1, mechanisms) J, last what is released of what is stored
//   work.at(x, u)                                 // the powers at a state (W)
//
// By Simpson's rule, but for motors: a torque that is held does tau . dq exactly, and one that follows its command with a lag
//   int (u + (m - u) exp(-s / lag)) v ds,     v the parabola through beginning, middle and end, exactly.
#pragma once

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/energy.h>

namespace dyntape {

class StepWork {
 public:
  struct States {
    const Eigen::VectorXd &begin, &middle, &end;
  };

  StepWork(const Scene& scene, EnergyMeter& meter);

  Eigen::MatrixXd between(const States& x, const Eigen::VectorXd& u, double h);
  const Eigen::MatrixXd& at(const Eigen::VectorXd& x, const Eigen::VectorXd& u);

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

// int_0^1 x^n exp(-z x) dx for n = 0, 1, 2; z >= 0.
Eigen::Vector3d moments_of_decay(double z);

}  // namespace dyntape
