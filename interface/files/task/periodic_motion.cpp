// SPDX-License-Identifier: BSD-3-Clause
//
// Motions of tasks that go on for ever: the block `periodic`, and what it makes of the task (periodic_gait.h).
#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/task/task_faults.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/motion/contact_changes.h>
#include <dyntape/interface/motion/robot_configuration.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;
using io::Section;
using RobotModel = dynamics::Model<double>;
using Names = std::vector<std::string>;

Names contacts_of(const TaskSpec& task) {
  Names names;
  for (const HeldContact& contact : task.robot.contacts) names.push_back(contact.frame);
  return names;
}

// What it is called in the next step.
std::string mirrored(const std::vector<std::pair<std::string, std::string>>& pairs, const std::string& name) {
  for (const auto& [one, other] : pairs) {
    if (name == one) return other;
    if (name == other) return one;
  }
  return name;
}

Names held_first(const TaskSpec& task) {
  return task.phases.empty() ? contacts_of(task) : task.phases.front().hold;
}

// Contacts that stand at the start, and what lands for them at the end.
struct Landed {
  std::string stands, lands;
};
std::vector<Landed> landed(const TaskSpec& task) {
  const Names last = task.phases.empty() ? contacts_of(task) : task.phases.back().hold;
  std::vector<Landed> list;
  for (const std::string& name : held_first(task)) {
    const std::string other = mirrored(task.periodic->contacts, name);
    if (!contains(last, other)) list.push_back({name, other});
  }
  return list;
}

HeldContact& contact_of(Task& task, const std::string& frame) {
  const auto is_it = [&](const HeldContact& contact) { return contact.frame == frame; };
  return *std::find_if(task.robot.contacts.begin(), task.robot.contacts.end(), is_it);
}

Eigen::Vector3d place_at(const RobotModel& model, const std::string& frame, const VectorXd& q) {
  dynamics::Data<double> data(model);
  dynamics::forward_kinematics<double>(model, data, q);
  return dynamics::frame_placement(model, data, model.frame_index(frame)).p;
}

// Pairs of joints or of contacts.
void read_swap(Section& block, const TaskSpec& task, const RobotModel* model, TaskSpec::Periodic& periodic) {
  const Names joints = model ? single_joint_names(*model) : Names{}, contacts = contacts_of(task);
  Names valid = joints;
  valid.insert(valid.end(), contacts.begin(), contacts.end());
  block.about("pairs of joints and of contacts that are exchanged from step to step: left and right");
  const Names names = distinct_names(block, "swap", model ? valid : Names{});
  if (!model) return;
  if (names.size() % 2 != 0)
    block.problem("swap", "'periodic.swap' has " + std::to_string(names.size()) + " names, expected pairs");
  for (std::size_t k = 0; k + 1 < names.size(); k += 2) {
    const bool is_joint = contains(joints, names[k]);
    if (is_joint != contains(joints, names[k + 1])) {
      block.problem("swap", "'periodic.swap' pairs '" + names[k] + "' with '" + names[k + 1] +
                                "', expected two joints or two contacts");
      continue;
    }
    (is_joint ? periodic.step.swapped : periodic.contacts).emplace_back(names[k], names[k + 1]);
  }
}

// (nq)
VectorXd read_advance(Section& block, const RobotModel& model) {
  Section by = block.child_or_empty("advance");
  VectorXd advance = VectorXd::Zero(model.nq);
  for (const auto& joint : model.joints) {
    if (dynamics::traits(joint.type).on_a_line && by.has(joint.name))
      advance[joint.idx_q] = by.get<double>(joint.name);
  }
  if (floats(model) && by.has("base")) advance.head<3>() = read_vector3(by, "base", std::nullopt);
  return advance;
}

}  // namespace

std::optional<TaskSpec::Periodic> read_periodic(Section& file, const TaskSpec& task,
                                                const RobotModel* model) {
  if (!file.about("a periodic motion, in place of a goal: the final state equals the initial state, up to "
                  "`swap` and `advance`")
           .has("periodic"))
    return {};
  Section block = file.child("periodic");
  TaskSpec::Periodic periodic;
  read_swap(block, task, model, periodic);
  block.about("change of positions per step, by joint [rad or m]; of a floating base: base \"x y z\"");
  if (model)
    periodic.step.advance = read_advance(block, *model);
  else
    block.defer("advance", "a number per joint that advances, by name", "0");
  block.about("whether a contact that lands at the end has an impact; off: it lands at rest");
  periodic.impact = block.get_or("impact", false);
  if (!model) return periodic;
  try {
    check(*model, periodic.step);
  } catch (const ArgumentError& e) {
    block.problem("swap", e.what());
  }
  return periodic;
}

std::vector<SpecFault> periodic_faults(const TaskSpec& spec) {
  const TaskSpec::Periodic& periodic = *spec.periodic;
  const RobotModel& model = spec.scene.model;
  std::vector<SpecFault> faults;
  if (!spec.goal.array().isNaN().all())
    faults.push_back(
        {"goal", "'goal' and 'periodic' both define the end of the motion; expected one of them"});
  if (spec.start.array().isNaN().any())
    faults.push_back(
        {"start.free",
         "'start.free' and 'periodic' exclude each other: the start of a periodic motion is free"});
  const auto carrier = [&](const std::string& frame) {
    const int body = model.frames[std::size_t(model.frame_index(frame))].body;
    return body < 0 ? "" : model.joints[std::size_t(body)].name;
  };
  const Names contacts = contacts_of(spec);
  for (const std::string& name : contacts) {
    const std::string other = mirrored(periodic.contacts, name);
    if (!contains(contacts, other)) {
      faults.push_back({"periodic.swap", "'periodic.swap' names '" + other + "', which is no contact"});
      return faults;
    }
    const std::string from = carrier(name), to = carrier(other);
    if (mirrored(periodic.step.swapped, from) == to) continue;
    faults.push_back({"periodic.swap", "'periodic.swap' makes contact '" + name + "' that of '" + other +
                                           "', but joint '" + from + "', which moves it, that of '" +
                                           mirrored(periodic.step.swapped, from) +
                                           "'; expected both of a leg to be swapped"});
    return faults;
  }
  if (periodic.impact && landed(spec).empty())
    faults.push_back({"periodic.impact",
                      "no contact lands at the end of the motion; expected a contact that holds in the first "
                      "phase and whose counterpart does not hold in the last phase"});
  return faults;
}

void place_last_step(Task& task) {
  const RobotModel& model = task.scene.model;
  const VectorXd q = task.start.head(model.nq), ahead = q + task.periodic->step.advance;
  const Names first = held_first(task);
  for (const std::string& name : first) {
    const std::string other = mirrored(task.periodic->contacts, name);
    if (contains(first, other)) continue;
    HeldContact &stands = contact_of(task, name), &behind = contact_of(task, other);
    behind.place = *stands.place - (place_at(model, name, ahead) - place_at(model, name, q));
    behind.axes = stands.axes;
  }
}

void close_motion(Task& task) {
  const TaskSpec::Periodic& periodic = *task.periodic;
  Task& first = task.parts.empty() ? task : task.parts.front();
  for (const Landed& contact : landed(task)) {
    for (Term& term : landing(task.scene, contact_of(first, contact.stands),
                              periodic.impact ? Landing::kImpact : Landing::kAtRest)) {
      term.name = contact.stands + (term.name.ends_with("rest") ? " begins at rest" : " begins at its place");
      first.problem.add(at_start(std::move(term)));
    }
  }
  std::vector<HeldContact> hit;
  for (const HeldContact& contact : first.robot.contacts)
    hit.push_back(contact_of(task, mirrored(periodic.contacts, contact.frame)));
  task.closing =
      periodic_gait(task.scene, periodic.step, periodic.impact ? impact(task.scene, hit) : StageFunction());
}

}  // namespace dyntape
