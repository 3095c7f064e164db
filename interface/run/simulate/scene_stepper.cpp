// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/scene_stepper.h>

#include <dyntape/interface/system/assembly.h>
#include <dyntape/interface/system/scene_system.h>

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

SceneStepper::SceneStepper(const Scene& scene, const CodegenOptions& options)
    : SceneStepper(scene, options, scene.tolerances) {}

SceneStepper::SceneStepper(const Scene& scene, const CodegenOptions& options, const Tolerances& tolerances)
    : scene(scene),
      options(options),
      stepper(system_of(scene.robot), scene.integrator, options,
              !scene.robot.constraints.rigid.empty() && RigidStepper::needs_jacobians(scene.integrator), 1,
              tolerances) {}

void SceneStepper::start(const VectorXd& x) {
  if (scene.robot.constraints.rigid.empty()) return;
  rigid.emplace(scene.robot, stepper, scene.integrator, options);
  rigid->start(x);
}

bool SceneStepper::step(double t, double h, const VectorXd& x, const VectorXd& u, VectorXd& next,
                        std::string* why) {
  return rigid ? rigid->step(t, h, x, u, next, why)
               : stepper.step(t, h, x.data(), u.data(), nullptr, next.data(), why);
}

}  // namespace dyntape
