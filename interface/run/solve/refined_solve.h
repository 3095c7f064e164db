// SPDX-License-Identifier: BSD-3-Clause
//
// A task solved on its mesh and, where the motion is not what its controls do, on finer ones, each from the motion of the
// last.  A task without phases is one phase.
//
//   const SolveReport report = solve_refined(task, mesh, watch);
//   report.solution        of the finest mesh that was solved
//   report.meshes          what came of each
#pragma once

#include <vector>

#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/run/solve/solve_report.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

// The task itself, or its phases.
std::vector<const Task*> parts_of(const Task& task);

SolveSizes sizes_of(const StagedProgram& program, const NlpShape& shape);

// Variables of a program on another mesh for motions of all its phases, moved to within the bounds, which they keep at their
// own points only.
std::vector<double> warm_start(const std::vector<Trajectory>& motions, const StagedNlp& program);

// Whether another mesh could make the motion true.  One that violates its constraints is wrong on its own.
bool is_too_coarse(const SolveReport& report, const Task& task);

// Interrupted, where the watch stops it before the first iteration; else as optimise().
SolveReport solve_refined(const Task& task, const MeshOptions& mesh, const SolveWatch& watch);
ShootingScheme shooting_scheme(const Task& task);
SolveReport solve_by_steps(const Task& task, const MeshOptions& mesh,
                           const SolveWatch& watch);  // task.by_ddp

}  // namespace dyntape
