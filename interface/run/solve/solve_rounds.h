// SPDX-License-Identifier: BSD-3-Clause
//
// The common part of a task's solves on a sequence of meshes: report, limits for all of them, and observers, also of
// compilers.  Solvers have no mimic joints; the report's motions have all joints (tied_joints.h).
//
// A function is compiled in pieces.  The estimated time is the mean time of the finished pieces times the number of
// remaining ones.
#pragma once

#include <memory>

#include <dyntape/interface/control/discretize/evaluation.h>
#include <dyntape/interface/motion/tied/tied_joints.h>
#include <dyntape/interface/run/solve/solve_report.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

class CompileProgress;

class SolveRounds {
 protected:
  SolveRounds(const Task& task, const SolveWatch& watch);

  // With the progress of a background compiler: finished pieces, all pieces, seconds left.
  void tell(SolveStage stage);
  // For functions with these options.  Reports if the solve waits for them.
  void watch_compilers(CodegenOptions& options);
  void check_not_stopped() const;  // Interrupted
  // The result of a mesh, with its time.
  void note(const Solution& solution, double seconds, double relaxation = 0);
  Solution of_all_joints(Solution solution) const;

  const Task& task_;
  const TiedJoints tied_;
  const SolveWatch& watch_;
  SolveReport report_;
  SolveMoment moment_{SolveStage::kRecording};
  int iterations_ = 0;

 private:
  const std::shared_ptr<CompileProgress> progress_;
};

}  // namespace dyntape
