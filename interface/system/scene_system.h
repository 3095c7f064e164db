// SPDX-License-Identifier: BSD-3-Clause
//
// A scene as what a Stepper (interface/simulation) integrates: the accelerations, or the Lagrangian and forces, of the robot
// with what acts on it.
//
//   Stepper stepper(system_of(scene.robot), scene.integrator, scene.evaluation);
//   system_of(scene.robot, 1, [](RecordedScene& s, const VectorXad& p) { s.effects.friction->smoothing = p[0]; });
//
// What the scene does not call for is not recorded.
#pragma once

#include <dyntape/interface/robot/robot_scene.h>
#include <dyntape/interface/system/system.h>

namespace dyntape {

// Commands are the torques of driven joints, in the order of actuated_dofs.  The last parameters are the forces of the rows of rigid
// contacts and stops (scene_constraints.h), held over a step: none without these.  Loops are part of the accelerations, and
// a scene with loops, or without velocity products, has no Lagrangian.
System system_of(const RobotScene& scene);

// The robot and what acts on it, on the tape.
struct RecordedScene {
  dynamics::Model<AD> model;
  dynamics::Effects<AD> effects;
};
RecordedScene recorded(const RobotScene& scene);

// A state of that system: (q, v, what motors with a lag give, which is what they are told).
Eigen::VectorXd state_of(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                         const Eigen::VectorXd& u);

// With parameters p (n_p) before these, which `edit` puts in the place of numbers of the scene.
using SceneEdit = std::function<void(RecordedScene&, const VectorXad& p)>;
System system_of(const RobotScene& scene, int n_p, const SceneEdit& edit);

}  // namespace dyntape
