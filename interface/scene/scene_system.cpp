// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/scene/scene_system.h>

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape {

namespace {

using dynamics::Data;
using dynamics::Model;

int reactions_of(const SceneConstraints& constraints) {
  int rows = 0;
  for (const auto& block : dynamics::blocks_of(constraints.rigid)) rows += block.rows;
  return rows;
}

// What rigid contacts and stops do to the joints, by the forces of their rows.
VectorXad reaction_torques(const RobotScene& scene, const Model<AD>& model, Data<AD>& data,
                           const SystemPoint<AD>& s) {
  return dynamics::unilateral_rows<AD>(model, data, scene.constraints.rigid, s.q).J.transpose() * s.p;
}

// The acceleration of a robot that is held: loops close, rigid contacts push as the parameters say.
VectorXad held_acceleration(const RobotScene& scene, const std::vector<int>& dofs, const SystemPoint<AD>& s) {
  const Model<AD> model = scene.model.cast<AD>();
  const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
  Data<AD> data(model);
  dynamics::EffectTorques<AD> torques(model);
  const VectorXad command = torques_at(dofs, s.drive, model.nv);
  const VectorXad driven = dynamics::driving_torques<AD>(model, torques, effects, command);
  VectorXad tau = driven + dynamics::effect_torques<AD>(model, data, torques, effects, s.q, s.v);
  if (!scene.constraints.rigid.empty()) tau += reaction_torques(scene, model, data, s);
  if (scene.constraints.loops.empty()) return dynamics::aba<AD>(model, data, s.q, s.v, tau, effects.acting());
  dynamics::ConstraintData<AD> loops(model, loops_of<AD>(scene.constraints));
  return dynamics::constrained_dynamics<AD>(model, data, loops, s.q, s.v, tau, effects.acting());
}

}  // namespace

System system_of(const RobotScene& scene) {
  System system;
  system.name = scene.model.name;
  system.model = scene.model;
  const std::vector<int> dofs = actuated_dofs(scene);
  system.n_u = int(dofs.size());
  system.lag = scene.lag;
  system.n_p = reactions_of(scene.constraints);
  system.acceleration = [scene, dofs](const SystemPoint<AD>& s) -> VectorXad {
    if (!scene.constraints.empty()) return held_acceleration(scene, dofs, s);
    const dynamics::Model<AD> model = scene.model.cast<AD>();
    const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad tau = torques_at(dofs, s.drive, model.nv);
    return dynamics::forward_dynamics<AD>(model, data, torques, effects, s.q, s.v, tau);
  };
  if (!scene.constraints.loops.empty()) return system;  // no Lagrangian: loops are equations of accelerations
  system.lagrangian = [acting = dynamics::acting_model(scene.model, scene.effects)](
                          const VectorXad& q, const VectorXad& v, const VectorXad&) -> AD {
    const dynamics::Model<AD> model = acting.cast<AD>();
    dynamics::Data<AD> data(model);
    const AD kinetic = dynamics::kinetic_energy<AD>(model, data, q, v);
    return kinetic - dynamics::potential_energy<AD>(model, data, q);
  };
  system.forces = [scene, dofs](const SystemPoint<AD>& s) -> VectorXad {
    const dynamics::Model<AD> model = scene.model.cast<AD>();
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
    const VectorXad command = torques_at(dofs, s.drive, model.nv);
    const VectorXad driven = dynamics::driving_torques<AD>(model, torques, effects, command);
    const VectorXad sum = driven + dynamics::effect_torques<AD>(model, data, torques, effects, s.q, s.v);
    if (scene.constraints.rigid.empty()) return sum;
    return sum + reaction_torques(scene, model, data, s);
  };
  return system;
}

}  // namespace dyntape
