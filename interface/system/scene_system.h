// SPDX-License-Identifier: BSD-3-Clause
//
// Makes the System of a scene, to integrate it with a Stepper (steps/stepper.h): the accelerations, or the
// Lagrangian and forces, of the robot with its effects.
//
//   Stepper stepper(system_of(scene.robot), scene.integrator, scene.evaluation);
//   system_of(scene.robot, 1, [](RecordedScene& s, const VectorXad& p) { s.effects.friction->smoothing = p[0]; });
//
// Effects that the scene does not choose are not recorded.
#pragma once

#include <dyntape/interface/robot/robot_scene.h>
#include <dyntape/interface/system/system.h>

namespace dyntape {

// Commands are the torques of the driven joints, in the order of actuated_dofs.  The last parameters are the forces
// of the rows of rigid contacts and stops (scene_constraints.h), constant over a step; none without contacts and
// stops.  Loops are part of the accelerations.  A scene with loops or mimic joints, or without velocity products, has
// no Lagrangian.
System system_of(const RobotScene& scene);

// The recorded robot and its effects.
struct RecordedScene {
  dynamics::Model<AD> model;
  dynamics::Effects<AD> effects;
};
RecordedScene recorded(const RobotScene& scene);

// A state of the system: (q, v, output of motors with lag); the motors' outputs are set to their commands.
Eigen::VectorXd state_of(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                         const Eigen::VectorXd& u);

// A system with additional parameters p (n_p), which come first.  `edit` replaces numbers of the scene by them.
using SceneEdit = std::function<void(RecordedScene&, const VectorXad& p)>;
System system_of(const RobotScene& scene, int n_p, const SceneEdit& edit);

}  // namespace dyntape
