// SPDX-License-Identifier: BSD-3-Clause
//
// Scenes as Python holds them, and many motions of one at once.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <tuple>

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/report/simulation_results.h>
#include <dyntape/interface/run/rollout/device_rollout.h>
#include <dyntape/interface/run/rollout/scene_rollout.h>

#include "motions.h"

namespace dyntape::python {

class PythonScene {
 public:
  explicit PythonScene(Scene read)
      : scene(std::move(read)), model(independent_model(scene.robot)), ties(ties_of(scene.robot)) {}

  const Scene scene;
  const dynamics::Model<double> model;  // of states: without joints that follow others
  const Ties ties;
  // Made once, without the lock, at the first call.
  SceneRollout& steps(bool with_jacobians) const;
  // On a device, as "opencl:0", with a policy or none; likewise.
  std::shared_ptr<const DeviceRollout> steps_on(const std::string& device, bool single,
                                                std::shared_ptr<const Function> policy) const;

 private:
  mutable std::mutex mutex_;
  mutable std::unique_ptr<SceneRollout> steps_[2];
  using OnDevice = std::tuple<std::string, bool, std::string>;  // its name, in float, content of the policy
  mutable std::map<OnDevice, std::shared_ptr<const DeviceRollout>> on_devices_;
};

// A motion and the scene that it is of, which reports refer to.
struct PythonSimulation {
  std::shared_ptr<const PythonScene> scene;
  SimulationReport report;
};

void bind_rollouts(nb::class_<PythonScene>& scene);

}  // namespace dyntape::python
