// SPDX-License-Identifier: BSD-3-Clause
//
// Runs a task file as a controller: its block `mpc`, and its problem with the goal as a cost.
//
//   const Task task = read_task("config/control/arm_holds.info");
//   const ControlReport report = control_task(task);
//   write_control(task, report, "out");
//
// Keys of `mpc`, with defaults:
//   duration [3]         of the loop (s)
//   period [0.02]        between steps (s)
//   delay [0]            from measurement to action (s)
//   feedback_period [0]  between corrections with the plan's gains (s; receding_horizon.h); 0: none
//   iterations [1]       per step; 0: until convergence
//   max_violation [0.01] of a usable plan, relative to nominal values
//   max_late [0.2]       largest fraction of steps, without the first, that may take longer than the period
//   disturbance          { at (s), v VECTOR (rad/s or m/s) }, added to the velocities; or { at, frame, impulse "x y
//                        z" (N s, world axes) }, the effect of an impulse at the origin of a link
//   plant [""]           a scene of the same robot (scene.h) whose simulation is the plant: its contacts, motors,
//                        steps.  Without it the plant is the task's own dynamics, with the contact forces of the plan
//   min_height [0]       (m) a floating base below it, or leaning by more than 60 degrees, has fallen: the loop ends
//                        without success
//
// The horizon is the task's.  Tracking costs pull to the goal, which is not a constraint at its end.  If the goal is
// out of reach, the robot stretches towards it, with the exact Hessian.
//
// write_control writes: closed_loop.csv (t, q.*, v.*, tau.*, and for each step ms, iterations, usable), report.json,
// closed_loop.svg (with targets, distance from the goal, and disturbances), steps.svg, motion.svg, motion.html.
// With feedback and a disturbance also feedback.svg: the distance from the goal with and without feedback, for which
// the loop runs twice.
//
// Errors.  ArgumentError for a task without tracking costs; those of close_loop.
#pragma once

#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/run/mpc/control_report.h>

namespace dyntape {

ControlReport control_task(const Task& task, const std::stop_token& stop = {},
                           const std::function<void(double t)>& watch = {});

std::vector<std::string> control_files();
void write_control(const Task& task, ControlReport& report, const std::string& folder,
                   const std::stop_token& stop = {});

// The change of the velocities (nv) of a free robot at q by an impulse (N s, world axes) at the origin of a frame.
Eigen::VectorXd struck(const RobotScene& scene, const Eigen::VectorXd& q, const std::string& frame,
                       const Eigen::Vector3d& impulse);

}  // namespace dyntape
