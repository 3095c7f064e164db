// SPDX-License-Identifier: BSD-3-Clause
//
// The result of a closed loop of any plant: for a terminal, as JSON, and as a picture.
//
//   ControlReport report = control_task(task);          // mpc_task.h, centroidal_task.h
//   std::cout << report.text();
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include <dyntape/interface/control/mpc/closed_loop.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/report/player/player_input.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape {

struct ControlReport {
  std::string task;  // its name
  ClosedLoop loop;
  double deadline = 0;                 // s, the period
  std::string off_of = {}, unit = {};  // "the goal of hand", "m"; empty where a task has no goal:
  double off_begin = 0, off_end = 0;   // the distance from it at the beginning and the end
  std::vector<double> off = {};        // and at every point of the motion
  std::vector<double> pushes = {};     // s, when a disturbance acts
  std::optional<std::vector<std::string>> beyond =
      {};  // where the robot's limits are exceeded, a sentence each; none: not asked
  // What feedback between plans is worth: how far off the loop is over time with it, and the same loop without.
  struct Feedback {
    std::vector<double> t, with, without;
    double after = 0;                              // s, the first push, from which on these are taken:
    double most_with = 0, most_without = 0;        // largest
    double typical_with = 0, typical_without = 0;  // root of the mean square
  };
  std::optional<Feedback> feedback;
  std::vector<std::string> unwritten;  // why results are not where they belong, a sentence each

  double most_late = 0.2;  // of the later steps, that may take longer than the deadline, as a part of all
  std::string note = {};   // what was done otherwise than asked for, and why

  double late_share() const;
  bool is_in_time() const { return late_share() <= most_late; }
  bool success() const { return loop.trouble.empty() && loop.unusable() == 0 && is_in_time(); }
  const ClosedLoop::Step* first_unusable() const;  // null: there is none
  std::string text() const;
  std::string json() const;
};

// How far a motion is off what it is to do, at a point.
struct Off {
  std::string what, unit;
  std::function<double(const Trajectory& motion, int point)> at;  // empty: there is nothing to be off
};
// What a file says of it; disturbances, plant and mesh are for the caller.
ClosedLoopOptions loop_options(const Task::Control& control, const std::stop_token& stop,
                               const std::function<void(double t)>& watch);
// The report of a loop: with feedback, of a second one without as well.
ControlReport report_loop(const Problem& problem, const ClosedLoopOptions& options, const Off& off);

// Plots the closed-loop trajectories; the lower panel shows the distance to the goal, vertical lines mark
// disturbances.
io::Plot with_pushes(io::Plot curves, const ControlReport& report);

io::Plot steps_plot(const ControlReport& report);

// Files of every loop; pictures need a motion of more than two points.
inline constexpr const char *kLoopTable = "closed_loop.csv", *kLoopReport = "report.json",
                            *kLoopSteps = "steps.svg", *kLoopFeedback = "feedback.svg",
                            *kLoopPlayer = "motion.html";
struct LoopPictures {
  std::vector<std::pair<std::string, io::Plot>> plots;  // file, picture
  PlayerInput player;
};
// What cannot be written is noted in the report, which is written last.
void write_loop(ControlReport& report, const io::CsvTable& table,
                const std::function<LoopPictures()>& pictures, const std::string& folder,
                const std::stop_token& stop);

// Of the step at each point of the motion, behind the plant's columns of closed_loop.csv.
void add_steps(const ClosedLoop& loop, io::CsvColumns& table);

}  // namespace dyntape
