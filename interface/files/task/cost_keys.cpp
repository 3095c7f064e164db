// SPDX-License-Identifier: BSD-3-Clause
//
// The block `costs` of task files.
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/task/task_costs.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/motion/gait.h>

namespace dyntape {

using io::Section;

namespace {

void read_tracking(Section& tracking, const std::vector<dynamics::MimicRule>& followers,
                   const dynamics::Model<double>* model, TaskSpec::Costs& c) {
  const auto weights = [&](Section& block, const char* key, const char* meaning) {
    return read_joint_values(block.about(meaning), key, model,
                             {.fallback = 0.0, .range = io::not_negative(), .followers = followers});
  };
  c.tracking_q = weights(tracking, "q", "weight of positions");
  c.tracking_v = weights(tracking, "v", "weight of velocities");
  tracking.about("weight of the position of goal.frame [1/m^2]");
  c.tracking_position = tracking.get_or("position", 0.0, io::not_negative());
  tracking.about("weight of its orientation [1/rad^2]");
  c.tracking_orientation = tracking.get_or("orientation", 0.0, io::not_negative());
  tracking.about("weight of the position of goal.base [1/m^2]");
  c.tracking_base_position = tracking.get_or("base_position", 0.0, io::not_negative());
  tracking.about("weight of its orientation [1/rad^2]");
  c.tracking_base_orientation = tracking.get_or("base_orientation", 0.0, io::not_negative());
  Section end = tracking.about("the same weights at the end only, not integrated").child_or_empty("end");
  c.end_q = weights(end, "q", "weight of positions");
  c.end_v = weights(end, "v", "weight of velocities");
}

}  // namespace

TaskSpec::Costs read_costs(Section& file, const TaskSpec& task, const dynamics::Model<double>* model) {
  Section costs = file.about("weights of the costs, which are integrated over the motion").child("costs");
  TaskSpec::Costs c;
  Section tracking =
      costs.about("weights of the squared distance from the goal, for those coordinates that the goal gives")
          .child_or_empty("tracking");
  for (const TaskCost& cost : task_costs())
    c.*cost.weight = costs.about(cost.meaning).get_or(cost.key, c.*cost.weight, io::not_negative());
  read_tracking(tracking, task.scene.mimics, model, c);
  return c;
}

const std::vector<TaskCost>& task_costs() {
  static const std::vector<TaskCost> costs = {
      {"control", "weight of the squared controls", &TaskSpec::Costs::control,
       [](const Problem&, const TaskSpec&, double weight) { return squared_controls(weight); }},
      {"effort", "weight of the squared controls, as fractions of the effort limits",
       &TaskSpec::Costs::effort,
       [](const Problem&, const TaskSpec& task, double weight) {
         return squared_fractions(task.scene, weight, task.robot.unit);
       }},
      {"acceleration", "weight of the squared accelerations", &TaskSpec::Costs::acceleration,
       [](const Problem& problem, const TaskSpec&, double weight) {
         return squared_accelerations(problem, weight);
       }},
      {"force", "weight of the squared difference of contact forces from their share of the robot's weight",
       &TaskSpec::Costs::force,
       [](const Problem& problem, const TaskSpec& task, double weight) {
         return squared_forces(problem, task.scene, task.robot.contacts, weight);
       }},
      {"time", "weight of the duration, if it is free [1/s]", &TaskSpec::Costs::time,
       [](const Problem&, const TaskSpec&, double weight) { return minimum_time(weight); }},
  };
  return costs;
}

}  // namespace dyntape
