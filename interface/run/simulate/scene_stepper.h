// SPDX-License-Identifier: BSD-3-Clause
//
// The steps of a scene, with rigid contacts and stops or without.
//
//   SceneStepper steps(scene, scene.evaluation);
//   VectorXd x = start_of(scene).x, next = x;
//   steps.start(x);
//   steps.step(0, scene.step, x, u, next, &why);
//
// Errors: ArgumentError where rigid contacts are below their ground at the start.
#pragma once

#include <optional>

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/rigid/rigid_step.h>

namespace dyntape {

struct SceneStart {
  Eigen::VectorXd x;        // (q, v, motors with a lag, which start where they are told to be)
  double assembled_by = 0;  // how far a joint was moved to close the loops
  double slowed_by = 0;     // how much its velocity was changed for that, largest entry
};
SceneStart start_of(const Scene& scene);

struct SceneStepper {
  SceneStepper(const Scene& scene, const CodegenOptions& options);
  SceneStepper(const Scene& scene, const CodegenOptions& options, const Tolerances& tolerances);

  void start(const Eigen::VectorXd& x);  // what touches there is closed
  // False where there is no step, and *why says what happened.
  bool step(double t, double h, const Eigen::VectorXd& x, const Eigen::VectorXd& u, Eigen::VectorXd& next,
            std::string* why);

  const Scene& scene;
  const CodegenOptions options;
  Stepper stepper;
  std::optional<RigidStepper> rigid;  // from the start on
};

}  // namespace dyntape
