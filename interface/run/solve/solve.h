// SPDX-License-Identifier: BSD-3-Clause
//
// Solves a task, verifies the motion and writes the results.
//
//   const Task task = read_task("config/tasks/arm_reaching.info");
//   SolveReport report = solve_task(task);
//   write_results(task, report, "out/arm_reaching");
//   std::cout << report.text();
//   return report.success() ? 0 : 1;
//
// write_results writes these files into the folder, each atomically:
//   trajectory.csv  t (s), q.*, v.*, a.*, tau.* (physical units) at every point
//   iterations.csv  the solver's log
//   report.json     all results, for programs
//   effective.info  the task with all defaults
//   trajectory.svg  positions, velocities and torques over time, with limits
//   motion.svg      the robot at several times
//   motion.html     the motion in 3D, played by a browser (player.h)
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/run/solve/solve_report.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

// If `watch` stops it before the first iteration, the status is interrupted.
SolveReport solve_task(const Task& task, const SolveWatch& watch = {});

// The names of the files.  Before long work, check that they can be written (check_can_write).
std::vector<std::string> result_files();

// Failures are listed in report.unwritten, e.g. pictures without gnuplot; all other files are written, the report
// last.  Files of an earlier run that are not written again are removed.  If the solve was interrupted, no pictures
// are drawn.
void write_results(const Task& task, SolveReport& report, const std::string& folder,
                   const std::stop_token& stop = {});

// The resolved scene, each effect with its number of operations, and the sizes of the program.  Does not solve.
std::string explain(const Task& task);

}  // namespace dyntape
