// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/compile_progress.h>

#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

void CompileProgress::note(std::size_t done, std::size_t of) {
  const std::scoped_lock lock(mutex_);
  const bool is_another = of != of_ || done < done_;
  if (is_another) first_ = done, since_ = std::chrono::steady_clock::now();
  done_ = done, of_ = of;
}

void CompileProgress::show_in(SolveMoment& moment) const {
  const std::scoped_lock lock(mutex_);
  moment.done = done_, moment.of = of_;
  moment.seconds_left =
      done_ > first_ ? seconds_since(since_) / double(done_ - first_) * double(of_ - done_) : 0;
}

void watch_compilers(CodegenOptions& options, std::shared_ptr<CompileProgress> progress,
                     const SolveMoment& moment, std::function<void(const SolveMoment&)> tell) {
  const bool is_waited_for = options.route != Route::kTiered;
  if (!is_waited_for) tell = {};  // the thread that compiles is not the one that solves
  // Functions keep this, so it holds what it needs.
  options.compiled_piece = [progress = std::move(progress), moment = SolveMoment(moment),
                            tell = std::move(tell)](std::size_t done, std::size_t of) mutable {
    progress->note(done, of);
    if (!tell) return;
    moment.stage = SolveStage::kCompiling;
    progress->show_in(moment);
    tell(moment);
  };
}

}  // namespace dyntape
