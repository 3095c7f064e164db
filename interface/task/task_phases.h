// SPDX-License-Identifier: BSD-3-Clause
//
// The phases of a task file: each a task of its own, and what ties them.
//
//   compose_phases(task, keys, to);             // task.phases, when the file is read
//   const Phases phases = phases_of(task);      // for a solver (phases.h)
#pragma once

#include <dyntape/interface/ocp/phases.h>
#include <dyntape/interface/task/task_keys.h>

namespace dyntape {

// The problem of a task or of one of its phases; the guess goes from one configuration to another.
void compose_problem(Task& task, const TaskKeys& keys, const Eigen::VectorXd& from,
                     const Eigen::VectorXd& to);

// `to`: where the guess of the whole motion ends (nq); entries that are open are NaN.
void compose_phases(Task& task, const TaskKeys& keys, const Eigen::VectorXd& to);

// Linked by what their states become: the same, or with an impact the velocities after it, by which all that is held comes to
// rest at once (constraints.h).  A task without phases is one.
Phases phases_of(const Task& task);
// One a phase: `mesh` with the intervals of each.
std::vector<MeshOptions> meshes_of(const Task& task, const MeshOptions& mesh);

}  // namespace dyntape
