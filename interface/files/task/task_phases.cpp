// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task_phases.h>

#include <algorithm>

#include <dyntape/interface/motion/contact_changes.h>
#include <dyntape/interface/motion/robot_configuration.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

bool is_held(const std::vector<std::string>& frames, const std::string& frame) {
  return std::find(frames.begin(), frames.end(), frame) != frames.end();
}

// Where contacts are while a phase lasts.
std::vector<HeldContact> held_in(const TaskKeys::Phase& phase, std::vector<HeldContact>& all) {
  for (const auto& [frame, by] : phase.moved) {
    for (HeldContact& contact : all)
      if (contact.frame == frame && contact.place) *contact.place += by;
  }
  std::vector<HeldContact> held;
  for (const HeldContact& contact : all)
    if (is_held(phase.hold, contact.frame)) held.push_back(contact);
  return held;
}

// Terms of the whole motion: along it, at its start, at its end.
bool is_of_phase(const Term& term, bool is_first, bool is_last) {
  if (term.where == Where::kTerminal) return is_last;
  if (term.where == Where::kInstant) return term.share == 0 ? is_first : is_last;
  return true;
}

// Configurations at the ends of phases: what their goals say, and in proportion to time between those.
std::vector<VectorXd> knots(const Task& task, const TaskKeys& keys, const VectorXd& from,
                            const VectorXd& to) {
  const auto& model = task.scene.model;
  const std::size_t n = keys.phases.size();
  std::vector<VectorXd> q = {from};
  for (const TaskKeys::Phase& phase : keys.phases) q.push_back(phase.goal.head(model.nq));
  q.back() = to;
  std::size_t known = 0;
  for (std::size_t k = 1; k <= n; ++k) {
    if (k < n && q[k].array().isNaN().all()) continue;
    fill_free(model, q[known], q[k]);
    double all = 0, so_far = 0;
    for (std::size_t i = known; i < k; ++i) all += keys.phases[i].duration;
    for (std::size_t i = known + 1; i < k; ++i) {
      so_far += keys.phases[i - 1].duration;
      q[i] = between(model, q[known], q[k], so_far / all);
    }
    known = k;
  }
  return q;
}

}  // namespace

void compose_phases(Task& task, const TaskKeys& keys, const VectorXd& from, const VectorXd& to) {
  const std::vector<VectorXd> q = knots(task, keys, from, to);
  const Eigen::Index n = keys.start.size();
  std::vector<HeldContact> contacts = task.robot.contacts;
  for (std::size_t k = 0; k < keys.phases.size(); ++k) {
    const TaskKeys::Phase& phase = keys.phases[k];
    const bool is_last = k + 1 == keys.phases.size();
    Task part = task;
    part.phases.clear();
    part.name = phase.name, part.impact = phase.impact;
    part.robot.duration = phase.duration;
    part.robot.contacts = held_in(phase, contacts);
    part.optimise.mesh.intervals = phase.intervals;
    TaskKeys own = keys;
    own.free_time = phase.free_time;
    if (k > 0) own.start = VectorXd::Constant(n, Problem::kFree);
    if (!is_last) own.goal = phase.goal, own.target = phase.target;
    std::erase_if(own.terms, [&](const TaskTerm& t) { return !is_of_phase(t.term, k == 0, is_last); });
    compose_problem(part, own, {{0, q[k]}, {1, q[k + 1]}});
    draw_to_goal(part, keys, is_last);
    for (const HeldContact& contact : contacts) {
      if (!contact.place) continue;
      if (!is_held(phase.hold, contact.frame)) part.problem.add(stays_above(task.scene, contact));
      const bool lands =
          k > 0 && is_held(phase.hold, contact.frame) && !is_held(keys.phases[k - 1].hold, contact.frame);
      if (!lands) continue;
      for (Term& term : landing(task.scene, contact, phase.impact ? Landing::kImpact : Landing::kAtRest))
        task.phases.back().problem.add(std::move(term));
    }
    task.phases.push_back(std::move(part));
  }
}

std::vector<MeshOptions> meshes_of(const Task& task, const MeshOptions& mesh) {
  std::vector<MeshOptions> meshes(std::max<std::size_t>(1, task.phases.size()), mesh);
  for (std::size_t k = 0; k < task.phases.size(); ++k)
    meshes[k].intervals = task.phases[k].optimise.mesh.intervals;
  return meshes;
}

Phases phases_of(const Task& task) {
  Phases phases(task.name);
  if (task.phases.empty()) phases.add(task.name, task.problem);
  for (const Task& phase : task.phases)
    phases.add(phase.name, phase.problem,
               phase.impact ? impact(phase.scene, phase.robot.contacts) : StageFunction());
  if (!task.closing.empty()) phases.close(task.closing);
  phases.controls = task.problem.controls;
  return phases;
}

}  // namespace dyntape
