// SPDX-License-Identifier: BSD-3-Clause
//
// The work of all that acts since the start of a motion without rigid contacts, told once for the start and once a step, in
// order; a step or two later where the quadrature looks ahead.
//
//   MotionWork work(scene, energy_meter, stepper, [](const MatrixXd& work) { ... });    // (flows + 1, mechanisms) J
//   work.start(x);
//   work.before_step(u); stepper.step(...); work.after_step(t, x, next);
//   work.finish();
//
// Between the places where it is looked at the motion is that of its scheme:
//   commands that stay      the cubic through the powers at four neighbouring steps, exact to h^4 (quadrature.h)
//   commands that change    Simpson's rule within each step, with the state after half a step (step_work.h)
//   adaptive steps          Gauss' rule within each internal step, on the scheme's own interpolant
#pragma once

#include <functional>

#include <dyntape/interface/run/simulate/step_work.h>
#include <dyntape/interface/system/quadrature.h>

namespace dyntape {

class MotionWork {
 public:
  using Take = std::function<void(const Eigen::MatrixXd& work)>;

  // Keeps references; the stepper of an adaptive scheme tells it of its internal steps from now on.
  MotionWork(const Scene& scene, EnergyMeter& meter, Stepper& stepper, Take take);
  MotionWork(const MotionWork&) = delete;
  MotionWork& operator=(const MotionWork&) = delete;

  void start(const Eigen::VectorXd& x);
  void before_step(const Eigen::VectorXd& u);
  void after_step(double t, const Eigen::VectorXd& x, const Eigen::VectorXd& next);
  void finish();

 private:
  enum class Rule { kCubic, kSimpson, kGauss };
  void append(const Eigen::VectorXd& x);

  const Scene& scene_;
  Stepper& stepper_;
  Take take_;
  StepWork of_steps_;
  Rule rule_;
  Quadrature cubic_;
  Eigen::Index flows_, mechanisms_;
  Eigen::VectorXd u_, middle_;
  Eigen::MatrixXd work_, of_step_;
};

}  // namespace dyntape
