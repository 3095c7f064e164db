// SPDX-License-Identifier: BSD-3-Clause
//
// The block `costs` of task files.
#include <algorithm>
#include <cmath>

#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/task/task_costs.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/motion/gait.h>

namespace dyntape {

namespace {

using io::Section;
using RobotModel = dynamics::Model<double>;

// Distances to what the goal does not say.
void check_tracking(Section& file, const TaskKeys& keys, const RobotModel* model) {
  Section tracking = file.child_or_empty("costs").child_or_empty("tracking");
  const auto refuse = [&](const char* key, const char* of) {
    tracking.problem(key, std::string("'costs.tracking.") + key + "' weighs a distance to '" + of +
                              "', which the file does not give");
  };
  const bool places = keys.target && keys.target->position, turns = keys.target && keys.target->orientation;
  if (keys.costs.tracking_position > 0 && !places) refuse("position", "goal.frame.position");
  if (keys.costs.tracking_orientation > 0 && !turns) refuse("orientation", "goal.frame.orientation");
  if ((keys.target || keys.closed) && !keys.costs.tracking_q.isZero(0)) refuse("q", "goal.q");
  if ((keys.target || keys.closed) && !keys.costs.end_q.isZero(0)) refuse("end.q", "goal.q");
  const bool has_base = model && floats(*model) && !keys.target;
  if (!model) return;
  if (keys.costs.tracking_base_position > 0 && (!has_base || std::isnan(keys.goal[0])))
    refuse("base_position", "goal.base.position");
  if (keys.costs.tracking_base_orientation > 0 && (!has_base || std::isnan(keys.goal[3])))
    refuse("base_orientation", "goal.base.roll_pitch_yaw");
}

TaskKeys::Costs costs_of(Section& file, const RobotModel* model) {
  Section costs = file.about("weights of what is integrated over the motion").child("costs");
  Section tracking = costs.about("weights of the squared distance to the motion's goal, where it is known")
                         .child_or_empty("tracking");
  TaskKeys::Costs c;
  for (const TaskCost& cost : task_costs())
    c.weights.push_back(costs.about(cost.meaning).get_or(cost.key, 0.0, io::not_negative()));
  c.tracking_q = read_joint_values(tracking.about("of positions"), "q", model, 0.0, io::not_negative());
  c.tracking_v = read_joint_values(tracking.about("of velocities"), "v", model, 0.0, io::not_negative());
  tracking.about("of the position of goal.frame [1/m^2]");
  c.tracking_position = tracking.get_or("position", 0.0, io::not_negative());
  tracking.about("of its orientation [1/rad^2]");
  c.tracking_orientation = tracking.get_or("orientation", 0.0, io::not_negative());
  tracking.about("of the position of goal.base [1/m^2]");
  c.tracking_base_position = tracking.get_or("base_position", 0.0, io::not_negative());
  tracking.about("of its orientation [1/rad^2]");
  c.tracking_base_orientation = tracking.get_or("base_orientation", 0.0, io::not_negative());
  Section end = tracking.about("the same at the end alone, not integrated").child_or_empty("end");
  c.end_q = read_joint_values(end.about("of positions"), "q", model, 0.0, io::not_negative());
  c.end_v = read_joint_values(end.about("of velocities"), "v", model, 0.0, io::not_negative());
  return c;
}

// A weight of a time that nobody may change.
void check_time_costs(Section& file, const TaskKeys& keys) {
  for (std::size_t k = 0; k < task_costs().size(); ++k) {
    const std::string key = task_costs()[k].key;
    const auto is_free = [](const TaskKeys::Phase& phase) { return phase.free_time.has_value(); };
    const bool some_phase = std::any_of(keys.phases.begin(), keys.phases.end(), is_free);
    if (key != kTimeCost || keys.free_time || some_phase || keys.costs.weights[k] == 0) continue;
    file.child("costs").problem(
        key, "'costs." + key +
                 "' weighs the duration, which is given; expected 'min_duration' and 'max_duration' "
                 "in 'horizon', between which it may be found");
  }
}

}  // namespace

const std::vector<TaskCost>& task_costs() {
  static const std::vector<TaskCost> costs = {
      {"control", "of the squared controls",
       [](const Problem&, const Task&, double weight) { return squared_controls(weight); }},
      {"effort", "of the squared fractions of the effort limits",
       [](const Problem&, const Task& task, double weight) {
         return squared_fractions(task.scene, weight, task.robot.unit);
       }},
      {"acceleration", "of the squared accelerations",
       [](const Problem& problem, const Task&, double weight) {
         return squared_accelerations(problem, weight);
       }},
      {"force", "of the squared difference of contacts' forces from their share of the weight",
       [](const Problem& problem, const Task& task, double weight) {
         return squared_forces(problem, task.scene, task.robot.contacts, weight);
       }},
      {kTimeCost, "of the duration, where it is to be found [1/s]",
       [](const Problem&, const Task&, double weight) { return minimum_time(weight); }},
  };
  return costs;
}

void read_costs(Section& file, TaskKeys& keys, const RobotModel* model) {
  keys.costs = costs_of(file, model);
  check_tracking(file, keys, model);
  check_time_costs(file, keys);
}

}  // namespace dyntape
