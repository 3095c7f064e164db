// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/solve_rounds.h>

#include <chrono>
#include <mutex>

#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

class CompileProgress {
 public:
  void note(std::size_t done, std::size_t of) {  // from any thread
    const std::scoped_lock lock(mutex_);
    const bool is_another = of != of_ || done < done_;
    if (is_another) first_ = done, since_ = std::chrono::steady_clock::now();
    done_ = done, of_ = of;
  }
  void show_in(SolveMoment& moment) const {
    const std::scoped_lock lock(mutex_);
    moment.done = done_, moment.of = of_;
    moment.seconds_left =
        done_ > first_ ? seconds_since(since_) / double(done_ - first_) * double(of_ - done_) : 0;
  }

 private:
  mutable std::mutex mutex_;
  std::size_t first_ = 0, done_ = 0, of_ = 0;
  std::chrono::steady_clock::time_point since_;
};

SolveRounds::SolveRounds(const Task& task, const SolveWatch& watch)
    : task_(task), tied_(task.scene), watch_(watch), progress_(std::make_shared<CompileProgress>()) {
  report_.demands = task.demands;
}

void SolveRounds::tell(SolveStage stage) {
  moment_.stage = stage;
  progress_->show_in(moment_);
  if (watch_.tell) watch_.tell(moment_);
}

void SolveRounds::watch_compilers(CodegenOptions& options) {
  options.stop = watch_.stop;
  // The thread that compiles in the background is not the one that solves.  Functions keep this, so it holds what it needs.
  const auto tell = options.route == Route::kTiered ? std::function<void(const SolveMoment&)>() : watch_.tell;
  options.compiled_piece = [progress = progress_, moment = moment_, tell](std::size_t done,
                                                                          std::size_t of) mutable {
    progress->note(done, of);
    if (!tell) return;
    moment.stage = SolveStage::kCompiling;
    progress->show_in(moment);
    tell(moment);
  };
}

Solution SolveRounds::of_all_joints(Solution solution) const {
  solution.motion = tied_.of_all(std::move(solution.motion));
  for (SolvedPhase& phase : solution.phases) phase.motion = tied_.of_all(std::move(phase.motion));
  solution.verification.miss_index = tied_.index_in_all(solution.verification.miss_index);
  return solution;
}

void SolveRounds::check_not_stopped() const {
  if (watch_.stop.stop_requested())
    throw Interrupted("interrupted before the first iteration: there is no motion yet");
}

void SolveRounds::note(const Solution& s, double seconds, double relaxation) {
  iterations_ += s.nlp.iterations();
  report_.meshes.push_back({moment_.intervals, s.nlp.iterations(), seconds, s.cost(),
                            s.verification.worst_relative, s.nlp.status, relaxation,
                            s.verification.passings.worst(), s.verification.cost_error, s.nlp.times,
                            s.verify_seconds});
}

}  // namespace dyntape
