// SPDX-License-Identifier: BSD-3-Clause
//
// The costs of one weight each that a task file may ask for, in its block `costs`.  A new one is
// its weight in TaskSpec::Costs and a row in cost_keys.cpp.
#pragma once

#include <vector>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

struct TaskCost {
  const char *key, *meaning;
  double TaskSpec::Costs::*weight;
  Term (*term)(const Problem& problem, const TaskSpec& task, double weight);
};

const std::vector<TaskCost>& task_costs();

}  // namespace dyntape
