// SPDX-License-Identifier: BSD-3-Clause
//
// What build_task makes a task of: the problem of each part, the phases and what ties them.
//
//   compose_problem(task, knots), draw_to_goal(task, task, true);
//   compose_phases(task, from, to);                              // task.parts
//   const Phases phases = phases_of(task);                       // for a solver (phases.h)
//
// Internal, but for what a solver asks.
#pragma once

#include <dyntape/interface/control/problem/phases.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape {

// Where the guess of a motion passes: straight from one to the next.
struct GuessKnot {
  double share;  // of the duration: 0 of the first, 1 of the last
  Eigen::VectorXd q;
};

// The problem of a task or of one of its phases, but for what draws to the goal.
void compose_problem(Task& task, const std::vector<GuessKnot>& guess);
// The costs of tracking: in every phase they draw to the goal of the whole motion, which `ends` with the last.  What the goal leaves
// open draws nowhere.
void draw_to_goal(Task& task, const TaskSpec& whole, bool ends);

// Bounds of states and controls; throws (refuse) where the task starts or ends beyond a limit of the robot by which the problem is
// bounded, or with bodies that are not clear of each other.
void bound_motion(Task& task);

// The guess of the whole motion goes from one configuration to another, over the goals of phases.
void compose_phases(Task& task, const Eigen::VectorXd& from, const Eigen::VectorXd& to);

// A motion that goes on for ever.  When contacts have places: one that does not stand at the start stood a step behind
// the one whose part it plays.  When the problem is composed: what has landed as the motion begins stands at its place, and
// the end becomes the start, task.closing.
void place_last_step(Task& task);
void close_motion(Task& task);

// What a message of a task begins with: its file, or `task "name"`.
std::string told_of(const TaskSpec& task);
// FileError of a task that has a file, else ArgumentError.
[[noreturn]] void refuse(const TaskSpec& task, const std::vector<std::string>& sentences);

// Linked by what their states become: the same, or with an impact the velocities after it, by which all that is held comes to
// rest at once (constraints.h).  A task without phases is one.
Phases phases_of(const Task& task);
// One a phase: `mesh` with the intervals of each.
std::vector<MeshOptions> meshes_of(const Task& task, const MeshOptions& mesh);

}  // namespace dyntape
