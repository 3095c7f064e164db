// SPDX-License-Identifier: BSD-3-Clause
//
// What each effect of a scene costs: the same scene with and without it, recorded, counted and timed.
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

// Of forward dynamics: accelerations, and with them their Jacobian by (q, v, tau).
struct FunctionCost {
  Cost value, jacobian;
};

struct EffectCost {
  std::string name;
  bool acts = false;
  FunctionCost added;  // the scene's less those without the effect
};

// Of the whole scene.  `measured`: also compiled and timed, some tens of milliseconds each once the cache has it.
FunctionCost scene_cost(const RobotScene& scene, const CodegenOptions& options, bool measured);
// One an effect, in the order in which they act.
std::vector<EffectCost> effect_costs(const RobotScene& scene, const CodegenOptions& options, bool measured);

// The resolved robot and what acts on it, as text: `explain` of scenes and tasks begins with it.
std::string robot_text(const RobotScene& scene, const std::string& urdf,
                       const std::vector<std::string>& notes);
// A table of effects with what each adds.
std::string effects_text(const std::vector<EffectCost>& costs);

// Loops, rigid contacts and hard limits, a line each; "" without.
std::string constraints_text(const RobotScene& scene);

}  // namespace dyntape
