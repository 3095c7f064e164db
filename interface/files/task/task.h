// SPDX-License-Identifier: BSD-3-Clause
//
// A task: a robot, its effects, start, goal and costs.  Read it from a file, or build it from data (task_spec.h).
//
//   robot
//   {
//     urdf ../robots/cart_pole.urdf        ; beside this file
//   }
//   actuated "slider"                       ; driven joints; default: all
//   horizon { duration 2  intervals 40 }
//   start   { q { slider 0  pivot 0 } }     ; at rest
//   goal    { q { slider 1  pivot 3.14159 } }
//   costs   { control 1 }
//
//   const Task task = read_task("config/tasks/cart_pole_swing_up.info");    // or build_task(spec), task_spec.h
//   const SolveReport report = solve_task(task);                            // solve.h
//
// Vectors over the joints are written by joint name, as above, as one quoted list, as one number for all, or with
// OCS2's indices.  Meanings, units and defaults of keys: dyntape check-config --keys, docs/reference/task_keys.md.
// The blocks:
//
//   scene, or robot, effects, actuated   robot, effects and driven joints (interface/files/scene/scene.h)
//   horizon, transcription, evaluation   a given or free duration; mesh and scheme; how functions are compiled
//   thrusters, contacts, gait            forces along axes of frames; frames held on the floor, always or by a schedule
//                                        (robot_problem.h, gait.h); the goal should then leave the joints free
//   contact_implicit                     for a scene with rigid contacts, whose times and forces the solver finds
//                                        (implicit_contacts.h); the scheme is radau-1
//   phases                               a sequence of phases (phases.h).  A contact that a phase holds and the
//                                        previous one does not is at its last position, plus an offset.  It closes at
//                                        rest, or with an impact.  Contacts that are not held stay above their last
//                                        position. trajectory.csv has two rows at the time where phases meet
//   periodic                             a periodic motion (periodic_gait.h).  Contacts of the first phase are where
//                                        `start` puts them; otherwise `start` is only the guess, and there is no
//                                        goal.  A contact that is held at the start and not at the end lands there
//                                        under the other name
//   start, goal, waypoints, reference    states, or poses of a frame, at the ends and on the way; a reference motion
//   obstacles, bodies                    every body keeps clear of every obstacle (capsules.h)
//   guess, costs, terms, bounds          initial guess; weights; terms by type (term_keys.h); limits
//   solver, verify, expected             methods and tolerances; conditions on the finished motion (verify.h, limits.h)
//   output, mpc, model_settings          pictures; the task as a controller (mpc_task.h); compiled libraries, as in
//                                        OCS2
//
// Errors.  FileError with all problems of the file and their positions; errors of reading the robot.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/settings.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

// The specification, and the problem built from it.  Contacts have their places here.
struct Task : TaskSpec {
  Problem problem = {};  // of all joints; phases_of (task_phases.h) and tracking_problem have no mimic joints
  std::vector<Capsule> passed = {};  // positions of waypoints, for pictures
  // True if inverse kinematics found no configuration for the goal of a frame; costs pull the frame as close as
  // possible.
  bool is_out_of_reach = false;
  std::string unreachable = {};  // reason if the lengths of the links alone make the goal unreachable, or ""
  // The distance of a state from the controller's target, for its report: the reference motion, the place of a
  // frame, or the goal; the first that the task has.  Empty if it has none.
  struct Aim {
    std::string what, unit;  // "the goal of hand"; "m"
    std::function<double(double t, const Eigen::VectorXd& x)> off;
    // The target for pictures: the state (nq + nv, NaN: free), or a frame and its place (m); else empty.
    std::function<Eigen::VectorXd(double t)> state = {};
    std::string frame = {};
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };
  Aim aim = {};
  Eigen::Vector2d travel = Eigen::Vector2d::Zero();  // m/s, velocity of a walking robot's goal
  // One per phase, each a task; empty: no phases.  `problem` then has all contacts at once, and only defines the
  // controls.
  std::vector<Task> parts = {};
  bool impact = false;  // of a part: contacts that close at its beginning have an impact
  // The map from the last state to the first of a periodic motion (periodic_gait.h); else empty.
  StageFunction closing = {};
};

// Builds robot, problem and phases from a specification (task_spec.h).  Errors.  ArgumentError, or FileError if the
// specification has a file, with one sentence for each inconsistency or impossibility.
Task build_task(TaskSpec spec);

// Reads a specification.  Settings override values of the file (settings.h).  For text in memory `path` is the name
// in messages, and its folder is the base of relative paths.
TaskSpec read_task_spec(const std::string& path, const std::vector<io::Setting>& settings = {});
// Reads and builds a task.
Task read_task(const std::string& path, const std::vector<io::Setting>& settings = {});
Task read_task_text(const std::string& text, const std::string& path,
                    const std::vector<io::Setting>& settings = {});

// The problem with the goal as a tracking cost instead of a constraint: for controllers, and for methods without
// constraints.  States have no mimic joints (tied_joints.h).  ArgumentError if no cost tracks the goal.
Problem tracking_problem(const Task& task);

}  // namespace dyntape
