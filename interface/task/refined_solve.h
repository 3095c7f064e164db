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
#include <string>
#include <vector>

#include <dyntape/interface/task/task.h>
#include <dyntape/interface/task/watch.h>
#include <dyntape/interface/transcription/optimise_phases.h>

namespace dyntape {

// What came of one mesh.
struct MeshRound {
  int intervals = 0, iterations = 0;
  double seconds = 0;  // of the solve and its verification
  double cost = 0, relative_defect = 0;
  SolveStatus status = SolveStatus::kSolverError;
};

struct RefinedSolve {
  std::unique_ptr<PhasedCollocation> program;
  PhasedSolution solution;
  std::vector<MeshRound>
      meshes;           // coarsest first; the last may have failed, and is then not that of `solution`
  std::string trouble;  // why a finer mesh was given up: "the mesh of 200 intervals: ..."; empty: it was not
  BuildReport build;
};

// Interrupted, where the watch stops it before the first iteration; else as optimise().
RefinedSolve solve_refined(const Task& task, const MeshOptions& mesh, const SolveWatch& watch);

}  // namespace dyntape
