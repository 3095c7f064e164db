// SPDX-License-Identifier: BSD-3-Clause
//
// How far compilers have come, whether the solve waits for them or not.
//
//   const auto progress = std::make_shared<CompileProgress>();
//   watch_compilers(mesh.evaluation, progress, moment, watch.tell);
//   ...
//   progress->show_in(moment);          // of a compiler in the background: pieces done, of how many, seconds left
//
// A function is compiled in pieces; the seconds left are those that its pieces took so far, times the pieces left.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>

#include <dyntape/interface/control/discretize/evaluation.h>
#include <dyntape/interface/run/solve/watch.h>

namespace dyntape {

class CompileProgress {
 public:
  void note(std::size_t done, std::size_t of);  // from any thread
  void show_in(SolveMoment& moment) const;

 private:
  mutable std::mutex mutex_;
  std::size_t first_ = 0, done_ = 0, of_ = 0;
  std::chrono::steady_clock::time_point since_;
};

// Of functions that are to be made with these options.  Where the solve waits for them it is told, as of `moment`.
void watch_compilers(CodegenOptions& options, std::shared_ptr<CompileProgress> progress,
                     const SolveMoment& moment, std::function<void(const SolveMoment&)> tell);

}  // namespace dyntape
