// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/scene_system.h>

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape {

RecordedScene recorded(const RobotScene& scene) { return {scene.model.cast<AD>(), scene.effects.cast<AD>()}; }

System system_of(const RobotScene& scene) {
  return system_of(scene, 0, [](RecordedScene&, const VectorXad&) {});
}

System system_of(const RobotScene& scene, int n_p, const SceneEdit& edit) {
  System system;
  system.name = scene.model.name;
  system.model = scene.model;
  const std::vector<int> dofs = actuated_dofs(scene);
  system.n_u = int(dofs.size());
  system.n_p = n_p;
  system.lag = scene.lag;
  const auto with = [scene, edit](const VectorXad& p) {
    RecordedScene now = recorded(scene);
    edit(now, p);
    return now;
  };
  system.acceleration = [with, dofs](const SystemPoint<AD>& s) -> VectorXad {
    const auto [model, effects] = with(s.p);
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad tau = torques_at(dofs, s.drive, model.nv);
    return dynamics::forward_dynamics<AD>(model, data, torques, effects, s.q, s.v, tau);
  };
  system.lagrangian = [with](const VectorXad& q, const VectorXad& v, const VectorXad& p) -> AD {
    const auto [robot, effects] = with(p);
    const dynamics::Model<AD> model = dynamics::acting_model<AD>(robot, effects);
    dynamics::Data<AD> data(model);
    const AD kinetic = dynamics::kinetic_energy<AD>(model, data, q, v, {.added = effects.acting().added});
    return kinetic - dynamics::potential_energy<AD>(model, data, q);
  };
  system.forces = [with, dofs](const SystemPoint<AD>& s) -> VectorXad {
    const auto [model, effects] = with(s.p);
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad command = torques_at(dofs, s.drive, model.nv);
    const VectorXad driven = dynamics::driving_torques<AD>(model, torques, effects, command);
    return driven + dynamics::effect_torques<AD>(model, data, torques, effects, s.q, s.v);
  };
  return system;
}

}  // namespace dyntape
