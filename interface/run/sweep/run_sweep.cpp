// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/run_sweep.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/io/table.h>

namespace dyntape {

namespace {

using SweepClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// Hands chunks to whoever has none, and keeps what comes back.
class SweepRun {
 public:
  SweepRun(const SceneSweep& sweep, SweepFolder& folder, const SweepRows& rows, const SweepWatch& watch)
      : sweep_(sweep),
        folder_(folder),
        watch_(watch),
        workers_(sweep, folder.identity(), rows, threads_of(sweep), watch.stop),
        begin_(SweepClock::now()) {
    for (long chunk = 0; chunk < chunks_of(sweep); ++chunk) {
      if (folder.has(chunk)) {
        resumed_ += range_of(sweep, chunk).count;
      } else {
        todo_.push_back(chunk);
      }
    }
    done_ = resumed_;
    if (watch.peers) watch.peers->begin(folder.identity());
  }

  // False: stopped.
  bool run() {
    tell();
    while (done_ < sweep_.rows()) {
      if (watch_.stop.stop_requested()) return false;
      while (workers_.waiting() < 2L * workers_.threads() && !todo_.empty()) workers_.give(next());
      if (todo_.empty() && workers_.waiting() == 0) compute_for_the_silent();
      hear_peers();
      if (std::optional<DoneChunk> done = workers_.take(watch_.peers ? 2ms : 100ms)) keep(*done);
    }
    return true;
  }

  long resumed() const { return resumed_; }
  long done() const { return done_; }

 private:
  long next() {
    const long chunk = todo_.front();
    todo_.pop_front();
    return chunk;
  }

  void keep(const DoneChunk& done) {
    if (folder_.has(done.chunk)) return;
    folder_.keep(done.chunk, done.text);
    done_ += range_of(sweep_, done.chunk).count;
    tell();
  }

  void tell() const {
    if (watch_.tell) watch_.tell(SweepProgress{done_, sweep_.rows(), resumed_, seconds_since(begin_)}.text());
  }

  void hear_peers() {
    if (!watch_.peers) return;
    while (const std::optional<FromPeer> news = watch_.peers->poll()) {
      if (news->what == FromPeer::What::kFailed)
        throw FileError("rank " + std::to_string(news->peer) + ": " + news->done.text);
      if (news->what == FromPeer::What::kDone) keep(news->done);
      const long count = news->what == FromPeer::What::kReady ? 2L * news->threads : 1;
      for (long k = 0; k < count && !todo_.empty(); ++k) {
        given_away_.push_back(next());
        watch_.peers->give(news->peer, given_away_.back());
      }
    }
  }

  // Nothing else is left: what others have had for longest.
  void compute_for_the_silent() {
    while (!given_away_.empty() && folder_.has(given_away_.front())) given_away_.pop_front();
    if (given_away_.empty()) return;
    workers_.give(given_away_.front());
    given_away_.pop_front();
  }

  const SceneSweep& sweep_;
  SweepFolder& folder_;
  const SweepWatch& watch_;
  SweepWorkers workers_;
  SweepClock::time_point begin_;
  std::deque<long> todo_, given_away_;
  long done_ = 0, resumed_ = 0;
};

std::string header_line(const SceneSweep& sweep) {
  std::string line;
  for (const std::string& name : row_names(sweep)) line += (line.empty() ? "" : ",") + name;
  return line + "\n";
}

}  // namespace

std::string SweepProgress::text() const {
  constexpr long kWidth = 24;
  const auto full = std::size_t(kWidth * rows / of);
  const std::string bar = std::string(full, '#') + std::string(kWidth - full, '.');
  std::string line = "[" + bar + "] " + std::to_string(100 * rows / of) + " %, " + io::with_groups(rows) +
                     " of " + io::with_groups(of) + " samples";
  const double speed = seconds > 0 ? double(rows - resumed) / seconds : 0;
  if (speed > 0) {
    line +=
        ", " + io::significant(speed, 3) + " a second, " + io::duration(double(of - rows) / speed) + " left";
  }
  return line;
}

SweepOutcome run_sweep(const SceneSweep& sweep, SweepFolder& folder, const SweepWatch& watch) {
  SweepOutcome outcome;
  outcome.identity = folder.identity();
  const auto begin = SweepClock::now();
  CodegenOptions options = sweep.evaluation;
  options.stop = watch.stop;
  options.compiled_piece = [&](std::size_t done, std::size_t of) {
    if (watch.tell)
      watch.tell("compiling: " + std::to_string(done) + " of " + std::to_string(of) + " pieces");
  };
  const SweepRows rows(sweep, options);
  outcome.operations = rows.operations();
  outcome.build_seconds = seconds_since(begin);
  const auto first = SweepClock::now();
  SweepRun run(sweep, folder, rows, watch);
  outcome.was_stopped = !run.run();
  if (watch.peers) watch.peers->dismiss();
  outcome.resumed = run.resumed();
  outcome.rows = run.done();
  outcome.step_seconds = seconds_since(first);
  if (outcome.was_stopped) return outcome;
  ComputedRows all = folder.all();
  outcome.csv = header_line(sweep) + all.text;
  outcome.failures = std::move(all.failures);
  outcome.table = io::parse_csv(outcome.csv, "sweep.csv");
  return outcome;
}

}  // namespace dyntape
