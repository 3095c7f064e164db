// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/tied_system.h>

namespace dyntape {

dynamics::Model<double> independent_model(const RobotScene& scene) {
  if (scene.mimics.empty()) return scene.model;
  dynamics::Model<double> own;
  own.name = scene.model.name;
  for (const auto& joint : scene.model.joints) {
    if (!rule_of(scene, joint.name)) own.add_joint(-1, joint, {}, {});
  }
  return own;
}

System independent_system_of(const RobotScene& scene) {
  System system = system_of(scene);
  if (scene.mimics.empty()) return system;
  system.model = independent_model(scene);
  system.acceleration = [all = system.acceleration, ties = ties_of(scene)](SystemPoint<AD> s) {
    s.q = ties.all_q(s.q), s.v = ties.all_v(s.v);
    return ties.own_v(all(s));
  };
  return system;
}

}  // namespace dyntape
