// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/scene_system.h>

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape {

System system_of(const RobotScene& scene) {
  System system;
  system.name = scene.model.name;
  system.model = scene.model;
  const std::vector<int> dofs = actuated_dofs(scene);
  system.n_u = int(dofs.size());
  system.lag = scene.lag;
  system.acceleration = [scene, dofs](const SystemPoint<AD>& s) -> VectorXad {
    const dynamics::Model<AD> model = scene.model.cast<AD>();
    const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad tau = torques_at(dofs, s.drive, model.nv);
    return dynamics::forward_dynamics<AD>(model, data, torques, effects, s.q, s.v, tau);
  };
  system.lagrangian = [effects = scene.effects, acting = dynamics::acting_model(scene.model, scene.effects)](
                          const VectorXad& q, const VectorXad& v, const VectorXad&) -> AD {
    const dynamics::Model<AD> model = acting.cast<AD>();
    dynamics::Data<AD> data(model);
    const dynamics::Effects<AD> all = effects.cast<AD>();
    const AD kinetic = dynamics::kinetic_energy<AD>(model, data, q, v, {.added = all.acting().added});
    return kinetic - dynamics::potential_energy<AD>(model, data, q);
  };
  system.forces = [scene, dofs](const SystemPoint<AD>& s) -> VectorXad {
    const dynamics::Model<AD> model = scene.model.cast<AD>();
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
    const VectorXad command = torques_at(dofs, s.drive, model.nv);
    const VectorXad driven = dynamics::driving_torques<AD>(model, torques, effects, command);
    return driven + dynamics::effect_torques<AD>(model, data, torques, effects, s.q, s.v);
  };
  return system;
}

}  // namespace dyntape
