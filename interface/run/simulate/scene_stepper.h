// SPDX-License-Identifier: BSD-3-Clause
//
// Makes the steps of a scene, with or without rigid contacts and stops.
//
//   SceneStepper steps(scene, scene.evaluation);
//   VectorXd x = start_of(scene).x, next = x;
//   steps.start(x);
//   steps.step(0, scene.step, x, u, next, &why);
//
// ArgumentError: a rigid contact is below its ground at the start.
#pragma once

#include <optional>

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/rigid/rigid_step.h>

namespace dyntape {

struct SceneStart {
  Eigen::VectorXd x;        // (q, v, motors with a lag, which start at their commands)
  double assembled_by = 0;  // largest motion of a joint to close the loops
  double slowed_by = 0;     // largest change of velocity to close the loops
};
SceneStart start_of(const Scene& scene);

struct SceneStepper {
  SceneStepper(const Scene& scene, const CodegenOptions& options);
  SceneStepper(const Scene& scene, const CodegenOptions& options, const Tolerances& tolerances);

  void start(const Eigen::VectorXd& x);  // contacts that touch at x are closed
  // False if there is no step; *why then has the reason.
  bool step(double t, double h, const Eigen::VectorXd& x, const Eigen::VectorXd& u, Eigen::VectorXd& next,
            std::string* why);

  const Scene& scene;
  const CodegenOptions options;
  Stepper stepper;
  std::optional<RigidStepper> rigid;  // from the start on
};

}  // namespace dyntape
