// SPDX-License-Identifier: BSD-3-Clause
//
// A scene as the plant of a closed loop: its engine, contacts and motors (simulate.h), driven by a plan's torques.
//
//   const auto plant = std::make_shared<ScenePlant>(scene, state);
//   options.plant = [plant](auto& x, double from, double to, const auto& control) { return plant->move(x, from, to, control); };
//
// Its steps are the scene's, shortened to end at the requested time, and halved if they have no solution.  The first
// controls are the commands of the driven joints; a command is held over a step.  States of motors with a lag, and
// the set of closed rigid contacts, persist between calls.
//
// ArgumentError: a rigid contact is below its ground at the start.
#pragma once

#include <functional>
#include <stop_token>

#include <dyntape/interface/run/simulate/scene_start.h>

namespace dyntape {

class ScenePlant {
 public:
  // start (q, v).  A stop request ends the compilation of the scene's functions: ToolError.
  ScenePlant(const Scene& scene, const Eigen::VectorXd& start, const std::stop_token& stop = {});

  // "", or the reason why there is no further step.
  std::string move(Eigen::VectorXd& x, double from, double to,
                   const std::function<Eigen::VectorXd(double t)>& control);

 private:
  Scene scene_;
  Eigen::Index commands_, moving_;  // driven joints, entries of (q, v)
  RobotStepper motion_;
};

}  // namespace dyntape
