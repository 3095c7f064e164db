// SPDX-License-Identifier: BSD-3-Clause
//
// The system of a scene in the states of its independent joints, without those that follow others (Ties, robot_scene.h).
//
//   Stepper stepper(independent_system_of(scene.robot), scene.integrator, scene.evaluation);      // x = (q, v, motors with lag)
//   const Ties ties = ties_of(scene.robot);
//   ties.all_q(q)                                                                                 // of all joints
//
// Steps are those of system_of(scene) (scene_system.h) at the states of all joints; without mimic joints it is that system.
#pragma once

#include <dyntape/interface/system/scene_system.h>

namespace dyntape {

System independent_system_of(const RobotScene& scene);

// Independent joints one beside the other, without bodies: the space of their states.
dynamics::Model<double> independent_model(const RobotScene& scene);

}  // namespace dyntape
