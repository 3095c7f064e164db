// SPDX-License-Identifier: BSD-3-Clause
//
// A task solved, verified and written down.
//
//   const Task task = read_task("config/tasks/arm_reaching.info");
//   SolveReport report = solve_task(task);
//   write_results(task, report, "out/arm_reaching");
//   std::cout << report.text();
//   return report.success() ? 0 : 1;
//
// write_results leaves in the folder, each file whole or not at all:
//   trajectory.csv  t (s), q.*, v.*, a.*, tau.* (physical units) at every point
//   iterations.csv  the solver's log
//   report.json     everything below, for programs
//   effective.info  the task as it was understood, defaults included
//   trajectory.svg  positions, velocities and torques over time, with limits
//   motion.svg      the robot at instants of its motion
//   motion.html     the motion in 3D, played by a browser (player.h)
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/run/solve/solve_report.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

// Interrupted, if the watch stops it before the first iteration.
SolveReport solve_task(const Task& task, const SolveWatch& watch = {});

// Their names.  For long work: whether they can be written is known before it (check_can_write).
std::vector<std::string> result_files();

// What cannot be written stands in report.unwritten, as pictures where there is no gnuplot; the rest is written, last the
// report, which then says so.  What is not written is removed, should it be there from an earlier motion; so
// are the pictures where the solve was interrupted, which draws none.
void write_results(const Task& task, SolveReport& report, const std::string& folder,
                   const std::stop_token& stop = {});

// What is recorded and what is not: the resolved scene, each effect with the operations it adds, the sizes of
// the program.  Solves nothing.
std::string explain(const Task& task);

}  // namespace dyntape
