// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task_phases.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/motion/contact_changes.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/standing.h>
#include <dyntape/interface/motion/tied/tied_joints.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// Where contacts are while a phase lasts.
std::vector<HeldContact> held_in(const TaskSpec::Phase& phase, std::vector<HeldContact>& all) {
  for (const auto& [frame, by] : phase.moved) {
    for (HeldContact& contact : all)
      if (contact.frame == frame && contact.place) *contact.place += by;
  }
  std::vector<HeldContact> held;
  for (const HeldContact& contact : all)
    if (contains(phase.hold, contact.frame)) held.push_back(contact);
  return held;
}

// Terms of the whole motion: along it, at its start, at its end.
bool is_of_phase(const TermSpec& term, bool is_first, bool is_last) {
  return !term.at || (*term.at == 0 ? is_first : is_last);
}

// Configurations at the ends of phases: what their goals say, and in proportion to time between those.
std::vector<VectorXd> knots(const TaskSpec& task, const VectorXd& from, const VectorXd& to) {
  const auto& model = task.scene.model;
  const std::size_t n = task.phases.size();
  std::vector<VectorXd> q = {from};
  for (const TaskSpec::Phase& phase : task.phases) q.push_back(phase.goal.head(model.nq));
  q.back() = to;
  std::size_t known = 0;
  for (std::size_t k = 1; k <= n; ++k) {
    if (k < n && q[k].array().isNaN().all()) continue;
    fill_free(model, q[known], q[k]);
    double all = 0, so_far = 0;
    for (std::size_t i = known; i < k; ++i) all += task.phases[i].duration;
    for (std::size_t i = known + 1; i < k; ++i) {
      so_far += task.phases[i - 1].duration;
      q[i] = between(model, q[known], q[k], so_far / all);
    }
    known = k;
  }
  return q;
}

// Where a contact that is in the air in phase k lands.
std::optional<Eigen::Vector3d> next_place(const TaskSpec& task, std::size_t k, const HeldContact& contact) {
  for (std::size_t later = k + 1; later < task.phases.size(); ++later) {
    if (!contains(task.phases[later].hold, contact.frame)) continue;
    Eigen::Vector3d place = *contact.place;
    for (const auto& [frame, by] : task.phases[later].moved)
      if (frame == contact.frame) place += by;
    return place;
  }
  return {};
}

// The contact stays above the lower one of its two footholds, and clears the way between them.
void add_swing(const TaskSpec& task, std::size_t k, HeldContact contact, Problem& problem) {
  const std::optional<Eigen::Vector3d> next = next_place(task, k, contact);
  if (next && task.phases[k].clearance > 0)
    problem.add(swing_clearance(task.scene, contact, *next, task.phases[k].clearance));
  if (next) contact.place->z() = std::min(contact.place->z(), next->z());
  problem.add(stays_above(task.scene, contact));
}

}  // namespace

void compose_phases(Task& task, const VectorXd& from, const VectorXd& to) {
  const std::vector<VectorXd> q = knots(task, from, to);
  std::vector<HeldContact> contacts = task.robot.contacts;
  for (std::size_t k = 0; k < task.phases.size(); ++k) {
    const TaskSpec::Phase& phase = task.phases[k];
    const bool is_last = k + 1 == task.phases.size();
    Task part = task;
    part.parts.clear(), part.phases.clear();
    part.name = phase.name, part.impact = phase.impact;
    part.robot.duration = phase.duration;
    part.robot.contacts = held_in(phase, contacts);
    part.optimise.mesh.intervals = phase.intervals;
    part.free_time = phase.free_time;
    if (k > 0) part.start.setConstant(Problem::kFree);
    if (!is_last) part.goal = phase.goal, part.target = phase.target;
    std::erase_if(part.terms, [&](const TermSpec& term) { return !is_of_phase(term, k == 0, is_last); });
    compose_problem(part, {{0, q[k]}, {1, q[k + 1]}});
    draw_to_goal(part, task, is_last);
    for (const HeldContact& contact : contacts) {
      if (!contact.place) continue;
      if (!contains(phase.hold, contact.frame)) add_swing(task, k, contact, part.problem);
      const bool lands =
          k > 0 && contains(phase.hold, contact.frame) && !contains(task.phases[k - 1].hold, contact.frame);
      if (!lands) continue;
      for (Term& term : landing(task.scene, contact, phase.impact ? Landing::kImpact : Landing::kAtRest))
        task.parts.back().problem.add(std::move(term));
    }
    task.parts.push_back(std::move(part));
  }
}

namespace {

// The highest points of swings that no configuration reaches while the other contacts hold.  Without any the robot
// may fly: only if its limb and the height of a flight of this duration are too short.
void add_unmet_clearances(const Task& task, std::size_t k, const std::vector<HeldContact>& contacts,
                          const VectorXd& q, std::vector<std::string>& sentences) {
  constexpr double kHalf = 0.5, kOfFlight = 1. / 8;
  const TaskSpec::Phase& phase = task.phases[k];
  if (!(phase.clearance > 0)) return;
  std::vector<std::pair<std::string, Eigen::Vector3d>> held;
  for (const HeldContact& contact : contacts)
    if (contact.place && contains(phase.hold, contact.frame))
      held.emplace_back(contact.frame, *contact.place);
  for (const HeldContact& contact : contacts) {
    if (!contact.place || contains(phase.hold, contact.frame)) continue;
    const std::optional<Eigen::Vector3d> next = next_place(task, k, contact);
    if (!next) continue;
    const std::string head = "phase '" + phase.name + "': '" + contact.frame + "' is to clear its way by " +
                             io::significant(phase.clearance, 3) + " m: ";
    if (held.empty()) {
      const double longest = phase.free_time ? phase.free_time->longest : phase.duration;
      const double most = task.scene.model.gravity.norm() * longest * longest * kOfFlight +
                          2 * limb_length(task.scene.model, contact.frame);
      if (phase.clearance > most)
        sentences.push_back(head + "in a flight of " + io::significant(longest, 3) +
                            " s it comes to less than " + io::significant(most, 3) + " m");
      continue;
    }
    std::vector<std::pair<std::string, Eigen::Vector3d>> feet = held;
    feet.emplace_back(contact.frame,
                      kHalf * (*contact.place + *next) + Eigen::Vector3d(0, 0, phase.clearance));
    const std::string missed = missed_feet(task.scene, q, feet, "place");
    if (!missed.empty()) sentences.push_back(head + "halfway " + missed);
  }
}

// Of phases whose contacts land elsewhere.
void add_unmet_footholds(const Task& task, std::vector<std::string>& sentences) {
  const VectorXd q = task.start.head(task.scene.model.nq);
  if (!q.allFinite()) return;
  std::vector<HeldContact> contacts = task.robot.contacts;
  for (const SunkenFoothold& foot : sunken_footholds(task))
    sentences.push_back("phase '" + task.phases[foot.phase].name +
                        "': " + below_floor(foot.frame, {0, 0, foot.z}, foot.floor) +
                        "; if the ground is lower there, its height is 'contacts.floor'");
  bool any_moved = false;
  for (std::size_t k = 0; k < task.phases.size(); ++k) {
    const TaskSpec::Phase& phase = task.phases[k];
    add_unmet_clearances(task, k, contacts, q, sentences);
    const std::vector<HeldContact> held = held_in(phase, contacts);
    const std::string head = "phase '" + phase.name + "': ";
    std::vector<std::pair<std::string, Eigen::Vector3d>> feet;
    for (const HeldContact& contact : held)
      if (contact.place) feet.emplace_back(contact.frame, *contact.place);
    any_moved = any_moved || !phase.moved.empty();
    if (!any_moved) continue;
    const std::string missed = missed_feet(task.scene, q, feet);
    if (!missed.empty()) sentences.push_back(head + missed);
  }
}

// Motors that cannot hold the robot at rest at the start.
void add_weak_motors(const Task& task, std::vector<std::string>& sentences) {
  const Task& part = task.parts.empty() ? task : task.parts.front();
  const std::string weak = weak_motors(task.scene, part.robot, part.problem, task.start);
  if (!weak.empty()) sentences.push_back(weak);
}

}  // namespace

std::optional<double> floor_of(const Task& task) {
  std::optional<double> lowest;
  for (const HeldContact& contact : task.robot.contacts)
    if (contact.place) lowest = std::min(lowest.value_or(HUGE_VAL), contact.place->z());
  return task.floor && !task.robot.contacts.empty() ? task.floor : lowest;
}

std::vector<SunkenFoothold> sunken_footholds(const Task& task) {
  const double floor = task.floor.value_or(std::min(0.0, floor_of(task).value_or(0)));
  std::vector<SunkenFoothold> feet;
  std::vector<HeldContact> contacts = task.robot.contacts;
  for (std::size_t k = 0; k < task.phases.size(); ++k) {
    const TaskSpec::Phase& phase = task.phases[k];
    for (const HeldContact& contact : held_in(phase, contacts)) {
      const bool is_lowered = std::any_of(phase.moved.begin(), phase.moved.end(), [&](const auto& moved) {
        return moved.first == contact.frame && moved.second.z() < 0;
      });
      if (contact.place && is_lowered && !below_floor(contact.frame, *contact.place, floor).empty())
        feet.push_back({contact.frame, contact.place->z(), floor, k});
    }
  }
  return feet;
}

std::vector<std::string> unmet_demands(const Task& task) {
  std::vector<std::string> sentences;
  if (!task.unreachable.empty()) sentences.push_back(task.unreachable);
  add_unmet_footholds(task, sentences);
  add_weak_motors(task, sentences);
  const std::string fast = task.parts.empty() ? short_duration(task.scene, task.problem) : "";
  if (!fast.empty()) sentences.push_back(fast);
  return sentences;
}

std::vector<MeshOptions> meshes_of(const Task& task, const MeshOptions& mesh) {
  std::vector<MeshOptions> meshes(std::max<std::size_t>(1, task.parts.size()), mesh);
  for (std::size_t k = 0; k < task.parts.size(); ++k)
    meshes[k].intervals = task.parts[k].optimise.mesh.intervals;
  return meshes;
}

Phases phases_of(const Task& task) {
  Phases phases(task.name);
  const TiedJoints tied(task.scene);
  if (task.parts.empty()) phases.add(task.name, tied.shortened(task.problem));
  for (const Task& phase : task.parts)
    phases.add(phase.name, tied.shortened(phase.problem),
               phase.impact ? tied.own_rows(impact(phase.scene, phase.robot.contacts)) : StageFunction());
  if (!task.closing.empty()) phases.close(task.closing);
  phases.controls = task.problem.controls;
  return phases;
}

}  // namespace dyntape
