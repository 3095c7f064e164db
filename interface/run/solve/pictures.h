// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures of a task's motion.
//
//   io::draw(trajectory_plot(task, motion), "out/trajectory.svg");
//   io::draw(motion_plot(task, motion), "out/motion.png");
//   write_player(motion_player(task, motion), "out/motion.html");
#pragma once

#include <dyntape/interface/report/player/player.h>
#include <dyntape/interface/report/plot/picture.h>
#include <dyntape/interface/run/solve/curves.h>

namespace dyntape {

// Positions, velocities and torques over time, with the limits that they approach.
io::Plot trajectory_plot(const Task& task, const Trajectory& motion);

// The same for a task as a controller, with its targets dotted in the colours of the curves.
io::Plot tracking_plot(const Task& task, const Trajectory& motion);

// The robot at several times, as lines between its joints and frames, in the task's view.
io::Plot motion_plot(const Task& task, const Trajectory& motion);

// The motion for a page that plays it, with the shapes of the robot's file.
PlayerInput motion_player(const Task& task, const Trajectory& motion, const std::stop_token& stop = {});

}  // namespace dyntape
