// SPDX-License-Identifier: BSD-3-Clause
//
// The costs with one weight each in the block `costs` of a task file.  To add a cost, add its weight to
// TaskSpec::Costs and a row to cost_keys.cpp.
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
