// SPDX-License-Identifier: BSD-3-Clause
//
// The cost of each effect of a scene: records, counts and times the scene with and without the effect.
//
//   for (const EffectCost& cost : effect_costs(scene, {})) std::cout << cost.name << cost.value.operations;
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

struct Cost {
  long operations = 0;
  double seconds = 0;  // of one evaluation; 0: not measured
};

// The cost of forward dynamics: accelerations, and accelerations with their Jacobian by (q, v, tau).
struct FunctionCost {
  Cost value, jacobian;
};

struct EffectCost {
  std::string name;
  bool acts = false;
  FunctionCost added;  // the scene's cost minus the cost without the effect
};

// The cost of the whole scene.  `measured`: also compiles and times, some tens of milliseconds each if the cache has
// it.
FunctionCost scene_cost(const RobotScene& scene, const CodegenOptions& options, bool measured);
// The cost of each effect, in the order in which the effects act.
std::vector<EffectCost> effect_costs(const RobotScene& scene, const CodegenOptions& options, bool measured);

// The resolved robot and its effects as text, the first part of `explain` for scenes and tasks.
std::string robot_text(const RobotScene& scene, const std::string& urdf,
                       const std::vector<std::string>& notes);
// A table of effects with their costs.
std::string effects_text(const std::vector<EffectCost>& costs);

// Loops, rigid contacts and hard limits, one line each; "" if there are none.
std::string constraints_text(const RobotScene& scene);

}  // namespace dyntape
