// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/scene_start.h>

#include <dyntape/interface/system/assembly.h>

namespace dyntape {

using Eigen::VectorXd;

SceneStart start_of(const Scene& scene) {
  SceneStart start;
  VectorXd q = scene.q, v = scene.v;
  start.assembled_by = close_loops(scene.robot, q, v);
  start.slowed_by = (v - scene.v).cwiseAbs().maxCoeff();
  VectorXd x(q.size() + v.size());
  x << q, v;
  start.x = state_of(scene.robot, q, v, scene.commands.at(0, x));
  return start;
}

RobotStepper stepper_of(const Scene& scene, const CodegenOptions& options) {
  return RobotStepper(scene.robot, scene.integrator, options, scene.tolerances);
}

}  // namespace dyntape
