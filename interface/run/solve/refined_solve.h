// SPDX-License-Identifier: BSD-3-Clause
//
// A task solved on its mesh and, where the motion is not what its controls do, on finer ones, each from the motion of the
// last.  A task without phases is one phase.
//
//   const RefinedSolve result = solve_refined(task, mesh, watch);
//   result.solution, *result.program        of the finest mesh that was solved
//   result.meshes                           what came of each
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/interface/control/solve/optimise_phases.h>
#include <dyntape/interface/files/task/limits.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

// What came of one mesh.
struct MeshRound {
  int intervals = 0, iterations = 0;
  double seconds = 0;  // of the solve and its verification
  double cost = 0, relative_defect = 0;
  SolveStatus status = SolveStatus::kSolverError;
};

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

struct PhaseTime {
  std::string name;
  double begin, duration;  // s
};

struct RefinedSolve {
  std::unique_ptr<PhasedCollocation> program;  // null by differential dynamic programming
  SolveSizes sizes;
  std::vector<std::string> active;  // names of variables and rows that rest on a bound
  std::optional<DdpFacts> ddp;
  Solution solution;
  std::vector<LimitExcess> excesses;
  std::vector<PhaseTime> phases;  // of a motion that has them
  std::vector<MeshRound>
      meshes;           // coarsest first; the last may have failed, and is then not that of `solution`
  std::string trouble;  // why a finer mesh was given up: "the mesh of 200 intervals: ..."; empty: it was not
  BuildReport build;
};

// Variables of a program on another mesh for motions of all its phases, moved to within the bounds, which they keep at their
// own points only.
std::vector<double> warm_start(const std::vector<Trajectory>& motions, const PhasedCollocation& program);

// Whether another mesh could make the motion true.  One that violates its constraints is wrong on its own.
bool is_too_coarse(const Solution& solution, const std::vector<LimitExcess>& excesses, const Task& task);

// Interrupted, where the watch stops it before the first iteration; else as optimise().
RefinedSolve solve_refined(const Task& task, const MeshOptions& mesh, const SolveWatch& watch);
ShootingScheme shooting_scheme(const Task& task);
RefinedSolve solve_by_steps(const Task& task, const MeshOptions& mesh,
                            const SolveWatch& watch);  // task.by_ddp

}  // namespace dyntape
