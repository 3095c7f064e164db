// SPDX-License-Identifier: BSD-3-Clause
//
// A task file as a controller: its block `mpc`, its problem without a goal to be reached in time.
//
//   const Task task = read_task("config/control/arm_holds.info");
//   const ControlReport report = control_task(task);
//   write_control(task, report, "out");
//
//   mpc   duration [3], of the loop; period [0.02], between steps; delay [0], from measuring to acting; feedback_period [0],
//         between corrections by the plan's gains (receding_horizon.h), 0: none, all s; iterations [1] of a step, 0: until it is
//         solved; max_violation [0.01]: of a usable plan, relative to nominal values; max_late [0.2]: most of the later steps that may take longer than the period, as a part of all;
//         disturbance { at (s), v VECTOR (rad/s or m/s) }: added to the velocities, or { at, frame, impulse "x y z" (N s, world
//         axes) }: what that does to the robot at the origin of a link;
//         plant [""]: a scene of the same robot (scene.h), whose simulation is the plant: its contacts, motors, steps.  Without
//         it the plant is the task's own dynamics, to which forces of contacts are what the plan says;
//         min_height [0] (m): a floating base below it, or that leans by more than 60 degrees, has fallen, which ends the loop and is no success
//
// The horizon is the task's; costs of tracking draw to the goal, which is not demanded at its end.
//
// A goal that is out of reach is one that the robot stretches towards: the exact Hessian is taken then.
//
// write_control leaves in the folder: closed_loop.csv (t, q.*, v.*, tau.*, and of each step ms, iterations, usable),
// report.json, closed_loop.svg (with targets, the distance from the goal, and when pushes act), steps.svg, motion.svg,
// motion.html; with feedback and a push, feedback.svg: how far it is from the goal with it and without, for which the loop is
// run twice.
//
// Errors: ArgumentError for a task without costs of tracking; those of close_loop.
#pragma once

#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/run/mpc/control_report.h>

namespace dyntape {

ControlReport control_task(const Task& task, const std::stop_token& stop = {},
                           const std::function<void(double t)>& watch = {});

std::vector<std::string> control_files();
void write_control(const Task& task, ControlReport& report, const std::string& folder,
                   const std::stop_token& stop = {});

// What an impulse (N s, world axes) at the origin of a frame adds to the velocities (nv) of a robot at q that nothing holds.
Eigen::VectorXd struck(const RobotScene& scene, const Eigen::VectorXd& q, const std::string& frame,
                       const Eigen::Vector3d& impulse);

}  // namespace dyntape
