// SPDX-License-Identifier: BSD-3-Clause
//
// A scene as the plant of a closed loop: its engine, contacts and motors (simulate.h), driven by a plan's torques.
//
//   const auto plant = std::make_shared<ScenePlant>(scene, state);
//   options.plant = [plant](auto& x, double from, double to, const auto& control) { return plant->move(x, from, to, control); };
//
// Its steps are those of the scene, shortened to end where it is asked to, and halved where they have no solution.  Of controls the first ones are the driven joints'; a
// command holds over a step.  States of motors with a lag, and which rigid contacts are closed, stay from call to call.
//
// Errors: ArgumentError where rigid contacts are below their ground at the start.
#pragma once

#include <functional>

#include <dyntape/interface/run/simulate/scene_stepper.h>

namespace dyntape {

class ScenePlant {
 public:
  ScenePlant(const Scene& scene, const Eigen::VectorXd& start);  // start (q, v)

  // "", or why there is no further step.
  std::string move(Eigen::VectorXd& x, double from, double to,
                   const std::function<Eigen::VectorXd(double t)>& control);

 private:
  bool advance(double t, double h, const Eigen::VectorXd& u, int halvings, std::string& why);

  Scene scene_;
  Eigen::Index commands_, moving_;  // driven joints, entries of (q, v)
  SceneStepper stepper_;
  Eigen::VectorXd x_, next_;  // with motors
};

}  // namespace dyntape
