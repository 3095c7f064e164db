// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/scene_system.h>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/robot/robot_callee.h>

#include <memory>

namespace dyntape {

namespace {

using dynamics::Data;
using dynamics::Model;

int reactions_of(const SceneConstraints& constraints) {
  int rows = 0;
  for (const auto& block : dynamics::blocks_of(constraints.rigid)) rows += block.rows;
  return rows;
}

// A point whose followers are where their leaders put them, and dynamics that keep it so.
SystemPoint<AD> tied_point(const Ties& ties, SystemPoint<AD> s) {
  s.q = ties.tied_q(s.q), s.v = ties.tied_v(s.v);
  return s;
}

// What rigid contacts and stops do to the joints, by the forces of their rows, which end the parameters.
VectorXad reaction_torques(const SceneConstraints& constraints, const Model<AD>& model, Data<AD>& data,
                           const SystemPoint<AD>& s) {
  const auto rows = dynamics::unilateral_rows<AD>(model, data, constraints.rigid, s.q);
  return rows.J.transpose() * s.p.tail(reactions_of(constraints));
}

// Constrained dynamics with their analytic derivatives, of a robot that no parameter changes; null: recorded as they are.
std::shared_ptr<const Callee> loops_callee(const RobotScene& scene, int n_p) {
  const auto acting = scene.effects.acting();
  const bool known = n_p == 0 && acting.coriolis && acting.added.count == 0 && scene.mimics.empty();
  if (scene.constraints.loops.empty() || !known || !is_worth_callees(scene.model)) return nullptr;
  return constrained_dynamics_callee(dynamics::acting_model(scene.model, scene.effects),
                                     scene.constraints.loops);
}

// The acceleration of a robot that is held: loops close, rigid contacts push as the parameters say.
VectorXad held_acceleration(const SceneConstraints& constraints, const std::shared_ptr<const Callee>& closed,
                            const Model<AD>& model, Data<AD>& data, const dynamics::Effects<AD>& effects,
                            const std::vector<int>& dofs, const SystemPoint<AD>& s) {
  dynamics::EffectTorques<AD> torques(model);
  const VectorXad command = torques_at(dofs, s.drive, model.nv);
  const VectorXad driven = dynamics::driving_torques<AD>(model, torques, effects, command);
  VectorXad tau = driven + dynamics::effect_torques<AD>(model, data, torques, effects, s.q, s.v);
  if (!constraints.rigid.empty()) tau += reaction_torques(constraints, model, data, s);
  if (constraints.loops.empty()) return dynamics::aba<AD>(model, data, s.q, s.v, tau, effects.acting());
  if (closed) {
    VectorXad x(3 * model.nv);
    x << s.q, s.v, tau;
    return call(closed, x);
  }
  dynamics::ConstraintData<AD> loops(model, loops_of<AD>(constraints));
  return dynamics::constrained_dynamics<AD>(model, data, loops, s.q, s.v, tau, effects.acting());
}

}  // namespace

RecordedScene recorded(const RobotScene& scene) { return {scene.model.cast<AD>(), scene.effects.cast<AD>()}; }

Eigen::VectorXd state_of(const RobotScene& scene, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                         const Eigen::VectorXd& u) {
  Eigen::VectorXd x(q.size() + v.size() + (scene.lag.array() > 0).count());
  x.head(q.size()) = q;
  x.segment(q.size(), v.size()) = v;
  for (Eigen::Index k = 0, m = q.size() + v.size(); k < scene.lag.size(); ++k) {
    if (scene.lag[k] > 0) x[m++] = u[k];
  }
  return x;
}

System system_of(const RobotScene& scene) {
  return system_of(scene, 0, [](RecordedScene&, const VectorXad&) {});
}

System system_of(const RobotScene& scene, int n_p, const SceneEdit& edit) {
  System system;
  system.name = scene.model.name;
  system.model = scene.model;
  const std::vector<int> dofs = actuated_dofs(scene);
  system.n_u = int(dofs.size());
  system.lag = scene.lag;
  const int n_forces = reactions_of(scene.constraints);
  system.n_p = n_p + n_forces;
  const auto with = [scene, edit, n_p](const VectorXad& p) {
    RecordedScene now = recorded(scene);
    edit(now, p.head(n_p));
    return now;
  };
  const auto closed = loops_callee(scene, n_p);
  const Ties ties = ties_of(scene);
  system.acceleration = [with, dofs, closed, ties,
                         constraints = scene.constraints](const SystemPoint<AD>& point) -> VectorXad {
    const SystemPoint<AD> s = tied_point(ties, point);
    const auto [model, effects] = with(s.p);
    Data<AD> data(model);
    data.following = ties.following<AD>();
    if (!constraints.empty()) return held_acceleration(constraints, closed, model, data, effects, dofs, s);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad tau = torques_at(dofs, s.drive, model.nv);
    return dynamics::forward_dynamics<AD>(model, data, torques, effects, s.q, s.v, tau);
  };
  // No Lagrangian: loops are equations of accelerations, without velocity products forces are no derivatives of energies, and
  // the momenta of mimic joints are those of their leaders.
  if (!scene.constraints.loops.empty() || !scene.effects.acting().coriolis || !ties.empty()) return system;
  system.lagrangian = [with](const VectorXad& q, const VectorXad& v, const VectorXad& p) -> AD {
    const auto [robot, effects] = with(p);
    const dynamics::Model<AD> model = dynamics::acting_model<AD>(robot, effects);
    dynamics::Data<AD> data(model);
    const AD kinetic = dynamics::kinetic_energy<AD>(model, data, q, v, {.added = effects.acting().added});
    return kinetic - dynamics::potential_energy<AD>(model, data, q);
  };
  system.forces = [with, dofs, constraints = scene.constraints](const SystemPoint<AD>& s) -> VectorXad {
    const auto [model, effects] = with(s.p);
    dynamics::Data<AD> data(model);
    dynamics::EffectTorques<AD> torques(model);
    const VectorXad command = torques_at(dofs, s.drive, model.nv);
    const VectorXad driven = dynamics::driving_torques<AD>(model, torques, effects, command);
    const VectorXad sum = driven + dynamics::effect_torques<AD>(model, data, torques, effects, s.q, s.v);
    if (constraints.rigid.empty()) return sum;
    return sum + reaction_torques(constraints, model, data, s);
  };
  return system;
}

}  // namespace dyntape
