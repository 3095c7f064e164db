// SPDX-License-Identifier: BSD-3-Clause
//
// The costs of one weight each that a task file may ask for, in its block `costs`.  A new one is a row in cost_keys.cpp.
#pragma once

#include <vector>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape {

struct TaskCost {
  const char *key, *meaning;
  Term (*term)(const Problem& problem, const Task& task, double weight);
};

const std::vector<TaskCost>& task_costs();
constexpr const char* kTimeCost = "time";  // the key of the one that only a free duration has

}  // namespace dyntape
