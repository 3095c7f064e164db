// SPDX-License-Identifier: BSD-3-Clause
//
// The parts from which build_task makes a task: the problem of each part, the phases, and the links between them.
//
//   compose_problem(task, knots), draw_to_goal(task, task, true);
//   compose_phases(task, from, to);                              // task.parts
//   const Phases phases = phases_of(task);                       // for a solver (phases.h)
//
// Internal, except for the solvers' functions.
#pragma once

#include <optional>

#include <dyntape/interface/control/problem/phases.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape {

// A point of the guess of a motion; the guess is straight between points.
struct GuessKnot {
  double share;  // of the duration: 0 for the first, 1 for the last
  Eigen::VectorXd q;
};

// The problem of a task or of one of its phases, without the costs that draw to the goal.
void compose_problem(Task& task, const std::vector<GuessKnot>& guess);
// The tracking costs.  In every phase they draw to the goal of the whole motion, which `ends` with the last phase.
// Values that the goal leaves open have no such cost.
void draw_to_goal(Task& task, const TaskSpec& whole, bool ends);

// Bounds of states and controls.  Throws (refuse) if the start or the end of the task is beyond a limit of the robot
// that bounds the problem, or has bodies that are not clear of each other.
void bound_motion(Task& task);

// The guess of the whole motion: from one configuration to another, over the goals of phases.
void compose_phases(Task& task, const Eigen::VectorXd& from, const Eigen::VectorXd& to);

// For a periodic motion.  When contacts have places: a contact that does not stand at the start stood one step
// behind the contact whose part it takes over.  When the problem is composed: contacts that have landed when the
// motion begins stand at their places, and the end becomes the start, task.closing.
void place_last_step(Task& task);
void close_motion(Task& task);

// The beginning of a task's messages: its file, or `task "name"`.
std::string told_of(const TaskSpec& task);
// Throws FileError for a task from a file, with the positions of the keys, otherwise ArgumentError.
[[noreturn]] void refuse(const TaskSpec& task, const std::vector<SpecFault>& faults);

// Sentences on what a task demands and its robot cannot do as far as the start shows it, in metres and newton metres: footholds
// below the floor or out of reach, a goal out of reach, motors too weak to hold the robot.  Takes milliseconds.
std::vector<std::string> unmet_demands(const Task& task);

// Height (m) of the floor that held contacts stand on: `contacts.floor`, otherwise the lowest contact at the start.
// Empty for a task without such contacts.
std::optional<double> floor_of(const Task& task);

// A foothold that a phase moves down to below the floor.
struct SunkenFoothold {
  std::string frame;
  double z, floor;    // m
  std::size_t phase;  // index
};
// In the order of the phases.  The floor is `contacts.floor`, otherwise 0, or the lowest contact at the start if that is below 0.
std::vector<SunkenFoothold> sunken_footholds(const Task& task);

// Phases are linked by their states: equal states, or with an impact the velocities after it, by which all closed
// contacts come to rest at once (constraints.h).  A task without phases is one phase.  States have no mimic joints
// (tied_joints.h).
Phases phases_of(const Task& task);
// One mesh for each phase: `mesh` with the phase's intervals.
std::vector<MeshOptions> meshes_of(const Task& task, const MeshOptions& mesh);

}  // namespace dyntape
