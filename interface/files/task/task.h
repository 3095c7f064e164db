// SPDX-License-Identifier: BSD-3-Clause
//
// A task file: a robot, what acts on it, where it shall go, and what that shall cost.
//
//   robot
//   {
//     urdf ../robots/cart_pole.urdf        ; beside this file
//   }
//   actuated "slider"                       ; joints that are driven; absent: all
//   horizon { duration 2  intervals 40 }
//   start   { q { slider 0  pivot 0 } }     ; at rest
//   goal    { q { slider 1  pivot 3.14159 } }
//   costs   { control 1 }
//
//   const Task task = read_task("config/tasks/cart_pole_swing_up.info");    // or build_task(spec), task_spec.h
//   const SolveReport report = solve_task(task);                            // solve.h
//
// Vectors over the joints are written by joint name, as above, as one quoted list, one number for all, or with OCS2's
// indices.  Keys with meanings, units and defaults: dyntape check-config --keys, docs/reference/task_keys.md.  The blocks:
//
//   scene, or robot, effects, actuated   what moves, what acts on it and where it is driven (interface/files/scene/scene.h)
//   horizon, transcription, evaluation   a duration, given or to be found; mesh and scheme; how functions are made
//   thrusters, contacts, gait            forces along axes of frames; frames that the floor holds, all along or by a schedule
//                                        (robot_problem.h, gait.h); the goal is to leave the joints free then
//   contact_implicit                     of a scene with rigid contacts, whose times and forces the solver finds
//                                        (implicit_contacts.h); its scheme is radau-1
//   phases                               one after another (phases.h).  What a phase holds and the one before does not is where
//                                        it last stood, or so much beside it, and at rest when the phase begins, or with an
//                                        impact is brought to rest by that; what is not held stays above where it stood.  Two
//                                        rows of trajectory.csv have the time at which phases meet
//   periodic                             the motion goes on for ever (periodic_gait.h).  Contacts of the first phase stand as
//                                        `start` has them; else that only says where the guess begins, and there is no goal.
//                                        What stands at the start and not at the end, under the other name, lands there
//   start, goal, waypoints, reference    states, or poses of a frame, met at the ends and on the way; a motion that is followed
//   obstacles, bodies                    every body keeps clear of every obstacle (capsules.h)
//   guess, costs, terms, bounds          where the solver begins; what is weighed; ready terms (term_keys.h); limits
//   solver, verify, expected             methods and tolerances; what the finished motion has to fulfil (verify.h, limits.h)
//   output, mpc, model_settings          pictures; the task as a controller (mpc_task.h); compiled libraries, as OCS2 spells it
//
// Errors: FileError listing every problem of the file with its place; those of reading the robot.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <dyntape/interface/files/info/settings.h>
#include <dyntape/interface/files/task/task_spec.h>

namespace dyntape {

// What it says, and what is built from that.  Contacts have their places here.
struct Task : TaskSpec {
  Problem problem = {};
  std::vector<Capsule> passed = {};  // places of waypoints, for pictures
  // No configuration was found in which a frame is where it shall be: costs draw it as near as it can get.
  bool is_out_of_reach = false;
  std::string unreachable = {};  // why lengths alone forbid it: a sentence; empty: they do not
  // How far a state is from what a controller draws it to, for its report: the motion that is followed, the place of a frame, or the
  // goal, whichever the task has first.  Empty where it has none.
  struct Aim {
    std::string what, unit;  // "the goal of hand"; "m"
    std::function<double(double t, const Eigen::VectorXd& x)> off;
    // The same for pictures: the state (nq + nv, NaN where it is open), or a frame and its place (m); empty where there is none.
    std::function<Eigen::VectorXd(double t)> state = {};
    std::string frame = {};
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };
  Aim aim = {};
  Eigen::Vector2d travel = Eigen::Vector2d::Zero();  // m/s, by which a walking robot's goal moves on
  // One a phase, each a task of its own; empty: it has none.  The problem is then that of all contacts at once, and only says
  // what the controls are.
  std::vector<Task> parts = {};
  bool impact = false;  // of a part: what lands at its beginning hits the floor
  // The first state from the last one, where the motion goes on for ever (periodic_gait.h); else empty.
  StageFunction closing = {};
};

// The robot, its problem and its phases from what is wanted of them (task_spec.h).  Errors: ArgumentError, or FileError of a spec
// that has a file, with a sentence for everything that does not go together, or that the robot cannot do.
Task build_task(TaskSpec spec);

// What a file says.  Settings stand in place of what it says (settings.h); of text in memory `path` stands for its place in
// messages, and its folder for where other files are looked for.
TaskSpec read_task_spec(const std::string& path, const std::vector<io::Setting>& settings = {});
// The same, built.
Task read_task(const std::string& path, const std::vector<io::Setting>& settings = {});
Task read_task_text(const std::string& text, const std::string& path,
                    const std::vector<io::Setting>& settings = {});

// The problem with a goal that costs of tracking draw to, which is not demanded: for controllers, and for methods that know no demands.
// ArgumentError where nothing draws.
Problem tracking_problem(const Task& task);

}  // namespace dyntape
