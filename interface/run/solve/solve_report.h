// SPDX-License-Identifier: BSD-3-Clause
//
// The result of a task: motion, log, verification, and its report.
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

// Additional facts of differential dynamic programming.
struct DdpFacts {
  double slope = 0;                // largest gradient of the cost with respect to a control inside its limits
  std::optional<bool> is_minimum;  // second order, if known
  double off_goal = 0;             // final distance from the goal, norm over its given entries
  // The entry of the goal with the largest error, relative to its movement, or to the initial distance of a frame.
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
  std::vector<std::string> active;  // names of variables and rows at a bound

  std::optional<DdpFacts> ddp;                 // if this was the method
  std::vector<MeshRound> meshes;               // coarsest first
  std::optional<ContactSimulation> simulated;  // with rigid contacts
  std::string refinement_trouble;              // why a finer mesh was not solved, or ""
  std::vector<LimitExcess> excesses;           // of the robot's limits
  bool are_limits_checked = true;              // false: the solve was interrupted before
  std::optional<Problem::Range> free_time;     // range of a free duration; motion.t ends with its value
  bool interrupted = false;                    // stopped by the caller: the motion is the best so far
  std::vector<std::string> unwritten;          // files that could not be written, with the reason

  Task::VerifyOptions demands;
  bool has_soft_goal = false;
  std::string unreachable = {};  // why no configuration meets the goal (Task::unreachable)
  std::string open_loop_unit;    // " rad", unit of the state of verification.miss

  // Success also requires, independently of the solver: constraints hold, multipliers prove optimality,
  // re-simulation reproduces the motion, and the robot's limits hold.
  bool feasible() const { return is_feasible(solution.verification, solution.demands); }
  bool optimal() const;  // with differential dynamic programming, first order according to the solver
  bool true_enough() const { return is_accurate(solution.verification, solution.demands); }
  bool reaches_goal() const;  // for differential dynamic programming, where the goal is a cost
  bool simulates() const;     // for simulated rigid contacts: equal positions
  bool within_limits() const { return (are_limits_checked && excesses.empty()) || !demands.limits; }
  bool cost_matches() const;  // the known optimum, if the task has one
  bool success() const;
  int iterations() const;                                                              // on all meshes
  SolveTimes times() const;                                                            // likewise
  double verify_seconds() const;                                                       // likewise
  double duration() const { return solution.motion.t[solution.motion.points() - 1]; }  // s
  std::string verdict() const;                                                         // one sentence

  std::string text() const;  // for people
  std::string json() const;  // for programs; reports success only if all files are written
};

}  // namespace dyntape
