// SPDX-License-Identifier: BSD-3-Clause
//
// What the solves of a task on one mesh after another have in common: a report, the limits for all of them together, and who
// watches, compilers too.
//
// A function is compiled in pieces; the seconds left are those that its pieces took so far, times the pieces left.
#pragma once

#include <memory>

#include <dyntape/interface/control/discretize/evaluation.h>
#include <dyntape/interface/run/solve/solve_report.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

class CompileProgress;

class SolveRounds {
 protected:
  SolveRounds(const Task& task, const SolveWatch& watch);

  // With how far a compiler in the background is: pieces done, of how many, seconds left.
  void tell(SolveStage stage);
  // Of functions that are to be made with these options.  Where the solve waits for them it is told.
  void watch_compilers(CodegenOptions& options);
  void check_not_stopped() const;  // Interrupted
  // What came of a mesh, in so many seconds.
  void note(const Solution& solution, double seconds, double relaxation = 0);

  const Task& task_;
  const SolveWatch& watch_;
  SolveReport report_;
  SolveMoment moment_{SolveStage::kRecording};
  int iterations_ = 0;

 private:
  const std::shared_ptr<CompileProgress> progress_;
};

}  // namespace dyntape
