// SPDX-License-Identifier: BSD-3-Clause
//
// What came of a task: the motion, how it was found, what it is worth, and what to say of it.
//
//   const SolveReport report = solve_task(task);                  // solve.h
//   std::cout << report.text();
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/control/discretize/evaluation.h>
#include <dyntape/interface/control/solve/solution.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/run/solve/contact_simulation.h>
#include <dyntape/interface/run/solve/limits.h>

namespace dyntape {

struct SolveSizes {
  std::size_t variables = 0, constraints = 0, jacobian = 0, hessian = 0;  // of the program; non-zeros
  std::size_t points = 0, operations = 0;                                 // operations of the stage's values
};

// What else there is to say of differential dynamic programming.
struct DdpFacts {
  double slope = 0;                // largest of the cost by a control that is at no limit
  std::optional<bool> is_minimum;  // of the second order, where that is known
  double off_goal = 0;             // distance from the goal at the end, norm over what it gives
  // What the goal gives that is missed most, as a part of how far the motion moves it, or of how far a frame begins from
  // its goal.
  double goal_miss = 0;
  std::string missed = {};
};

struct SolveReport {
  std::string task, robot;
  std::vector<std::string> notes;  // of the task
  Solution solution;
  std::optional<Task::Expected> expected;
  SolveSizes sizes;
  BuildReport build;
  std::vector<std::string> active;  // names of variables and rows that rest on a bound

  std::optional<DdpFacts> ddp;                 // where that was the method
  std::vector<MeshRound> meshes;               // coarsest first
  std::optional<ContactSimulation> simulated;  // of rigid contacts
  std::string refinement_trouble;              // why a finer mesh was given up, or ""
  std::vector<LimitExcess> excesses;           // of the robot's limits
  std::optional<Problem::Range>
      free_time;                       // of the duration, where it was to be found: motion.t ends with it
  bool interrupted = false;            // stopped from outside: the motion is the best so far
  std::vector<std::string> unwritten;  // why results are not where they belong, a sentence each

  Task::VerifyOptions demands;
  bool has_soft_goal = false;
  std::string unreachable = {};  // why no configuration meets the goal (Task::unreachable)
  std::string open_loop_unit;    // " rad", of the state that verification.miss is of

  // A motion that breaks a constraint, has multipliers that do not show it to be an optimum, is not what its controls do,
  // or is beyond the robot, is no success, whatever the solver says.
  bool feasible() const { return is_feasible(solution.verification, solution.demands); }
  bool optimal() const;  // by differential dynamic programming the first order is the solver's own word
  bool true_enough() const { return is_accurate(solution.verification, solution.demands); }
  bool reaches_goal() const;  // by differential dynamic programming, which does not demand it
  bool simulates() const;     // where rigid contacts are simulated, to the same positions
  bool within_limits() const { return excesses.empty() || !demands.limits; }
  bool cost_matches() const;  // the known optimum, where the task states one
  bool success() const;
  int iterations() const;                                                              // on all meshes
  double duration() const { return solution.motion.t[solution.motion.points() - 1]; }  // s
  std::string verdict() const;                                                         // one sentence

  std::string text() const;  // for people
  std::string json() const;  // for programs; of success where all is written as well
};

}  // namespace dyntape
