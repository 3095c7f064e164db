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

#include <dyntape/interface/files/task/limits.h>
#include <dyntape/interface/run/solve/refined_solve.h>

namespace dyntape {

struct SolveReport {
  std::string task, robot;
  std::vector<std::string> notes;  // of the task
  Solution solution;
  std::optional<Task::Expected> expected;
  SolveSizes sizes;
  BuildReport build;
  std::vector<std::string> active;  // names of variables and rows that rest on a bound

  std::optional<DdpFacts> ddp;        // where that was the method
  std::vector<MeshRound> meshes;      // coarsest first
  std::string refinement_trouble;     // why a finer mesh was given up, or ""
  std::vector<LimitExcess> excesses;  // of the robot's limits
  std::vector<PhaseTime>
      phases;  // of a motion that has them, whose points then stand one after another in `solution`
  std::optional<Problem::Range>
      free_time;                       // of the duration, where it was to be found: motion.t ends with it
  bool interrupted = false;            // stopped from outside: the motion is the best so far
  std::vector<std::string> unwritten;  // why results are not where they belong, a sentence each

  Task::VerifyOptions demands;
  bool has_soft_goal = false;
  std::string open_loop_unit;  // " rad", of the state that verification.miss is of

  // A motion that breaks a constraint, has multipliers that do not show it to be an optimum, is not what its controls do,
  // or is beyond the robot, is no success, whatever the solver says.
  bool feasible() const { return is_feasible(solution.verification, solution.demands); }
  bool optimal() const;  // by differential dynamic programming the first order is the solver's own word
  bool true_enough() const { return is_accurate(solution.verification, solution.demands); }
  bool reaches_goal() const;  // by differential dynamic programming, which does not demand it
  bool within_limits() const { return excesses.empty() || !demands.limits; }
  bool cost_matches() const;  // the known optimum, where the task states one
  bool success() const;
  int iterations() const;                                                              // on all meshes
  double duration() const { return solution.motion.t[solution.motion.points() - 1]; }  // s
  std::string verdict() const;                                                         // one sentence

  std::string text() const;  // for people
  std::string json() const;  // for programs; of success where all is written as well
};

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
