// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/task/task_costs.h>

namespace dyntape {

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
      {kTimeCost, "of the duration, where it is to be found [1/s]",
       [](const Problem&, const Task&, double weight) { return minimum_time(weight); }},
  };
  return costs;
}

}  // namespace dyntape
