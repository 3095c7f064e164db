// SPDX-License-Identifier: BSD-3-Clause
//
// Scenes as Python holds them, and many motions of one at once.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/report/simulation_results.h>
#include <dyntape/interface/robot/workspace_pool.h>

#include "motions.h"

namespace dyntape::python {

// Steps of a scene, for any number of threads; made at the first call.
struct SceneSteps {
  SceneSteps(const Scene& scene, bool with_jacobians, const std::stop_token& stop);
  std::unique_ptr<Stepper> stepper() const;  // for one more thread

  const Scene& scene;
  const CodegenOptions options;
  const bool with_jacobians;
  const Stepper first;
  dyntape::detail::WorkspacePool<Stepper> pool;
};

class PythonScene {
 public:
  explicit PythonScene(Scene read) : scene(std::move(read)) {}

  const Scene scene;
  // Made once, without the lock.
  SceneSteps& steps(bool with_jacobians) const;

 private:
  mutable std::mutex mutex_;
  mutable std::unique_ptr<SceneSteps> steps_[2];
};

// A motion and the scene that it is of, which reports refer to.
struct PythonSimulation {
  std::shared_ptr<const PythonScene> scene;
  SimulationReport report;
};

void bind_rollouts(nb::class_<PythonScene>& scene);

}  // namespace dyntape::python
