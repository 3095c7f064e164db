// SPDX-License-Identifier: BSD-3-Clause
//
// The start of a scene's motion, and its steps.
//
//   RobotStepper motion = stepper_of(scene, scene.evaluation);         // robot_stepper.h
//   motion.start(start_of(scene).x);
//   run(motion, {.to = scene.steps(), .h = scene.step}, inputs, observers...);      // run.h
#pragma once

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/rigid/robot_stepper.h>

namespace dyntape {

struct SceneStart {
  Eigen::VectorXd x;        // (q, v, motors with a lag, which start at their commands)
  double assembled_by = 0;  // largest motion of a joint to close the loops
  double slowed_by = 0;     // largest change of velocity to close the loops
};
SceneStart start_of(const Scene& scene);

// Keeps a reference to the scene.
RobotStepper stepper_of(const Scene& scene, const CodegenOptions& options);

}  // namespace dyntape
