// SPDX-License-Identifier: BSD-3-Clause
//
// Solves a task by the loop of meshes in control/solve/solve.h.  A task without phases is one phase.
//
//   const SolveReport report = solve_refined(task, mesh, watch);
//   report.solution        of the finest solved mesh
//   report.meshes          the result of each mesh
#pragma once

#include <vector>

#include <dyntape/interface/control/solve/solve.h>
#include <dyntape/interface/run/solve/solve_report.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

// The phases of the task, or the task itself.
std::vector<const Task*> parts_of(const Task& task);

SolveSizes sizes_of(const StagedProgram& program, const NlpShape& shape);

// If `watch` stops it before the first iteration, the status is interrupted; else like optimise().
SolveReport solve_refined(const Task& task, const MeshOptions& mesh, const SolveWatch& watch);
ShootingScheme shooting_scheme(const Task& task);
SolveReport solve_by_steps(const Task& task, const MeshOptions& mesh,
                           const SolveWatch& watch);  // task.by_ddp

}  // namespace dyntape
