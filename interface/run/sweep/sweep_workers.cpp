// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/sweep_workers.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/threads.h>

namespace dyntape {

using namespace std::chrono_literals;

unsigned threads_of(const SceneSweep& sweep) {
  return sweep.threads > 0 ? sweep.threads : codegen::thread_count();
}

SweepWorkers::SweepWorkers(const SceneSweep& sweep, std::string identity, const SweepRows& rows,
                           unsigned threads, std::stop_token stop)
    : sweep_(sweep), identity_(std::move(identity)) {
  stopped_.emplace(std::move(stop), [this] { over_.request_stop(); });
  for (unsigned k = 0; k < threads; ++k) {
    threads_.emplace_back([this, own = std::make_shared<SweepRows>(rows.twin())] { work(*own); });
  }
}

SweepWorkers::~SweepWorkers() {
  over_.request_stop();
  threads_.clear();  // joins them
}

long SweepWorkers::waiting() const {
  const std::scoped_lock lock(mutex_);
  return waiting_;
}

void SweepWorkers::give(long chunk) {
  {
    const std::scoped_lock lock(mutex_);
    todo_.push_back(chunk);
    ++waiting_;
  }
  given_.notify_one();
}

std::optional<long> SweepWorkers::next() {
  std::unique_lock lock(mutex_);
  if (!given_.wait(lock, over_.get_token(), [this] { return !todo_.empty(); })) return {};
  const long chunk = todo_.front();
  todo_.pop_front();
  return chunk;
}

void SweepWorkers::work(SweepRows& rows) {
  try {
    while (const std::optional<long> chunk = next()) {
      const ChunkRange range = range_of(sweep_, *chunk);
      const std::optional<ComputedRows> computed = rows.compute(range.first, range.count, over_.get_token());
      if (!computed) return;
      std::string text = chunk_text(sweep_, identity_, *chunk, *computed);
      const std::scoped_lock lock(mutex_);
      finished_.push_back({*chunk, std::move(text)});
      done_.notify_one();
    }
  } catch (...) {
    const std::scoped_lock lock(mutex_);
    failure_ = std::current_exception();
    done_.notify_one();
  }
}

std::optional<DoneChunk> SweepWorkers::take(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  done_.wait_for(lock, over_.get_token(), patience, [this] { return !finished_.empty() || failure_; });
  if (failure_) std::rethrow_exception(failure_);
  if (finished_.empty()) return {};
  DoneChunk done = std::move(finished_.front());
  finished_.pop_front();
  --waiting_;
  return done;
}

namespace {

void await_dismissal(SweepCoordinator& master) {
  while (true) {
    const std::optional<SweepCoordinator::Order> order = master.poll();
    if (order && order->is_dismissed) return;
    std::this_thread::sleep_for(2ms);
  }
}

// Until it is dismissed.
void work_for(SweepCoordinator& master, SweepWorkers& workers) {
  while (true) {
    while (const std::optional<SweepCoordinator::Order> order = master.poll()) {
      if (order->is_dismissed) return;
      workers.give(order->chunk);
    }
    if (std::optional<DoneChunk> done = workers.take(2ms))
      master.tell({.what = FromPeer::What::kDone, .done = std::move(*done)});
  }
}

}  // namespace

void serve_sweep(const std::string& file, const std::vector<io::Setting>& settings,
                 SweepCoordinator& master) {
  const std::optional<std::string> identity = master.begin();
  if (!identity) return;
  try {
    const SceneSweep sweep = read_sweep(file, settings);
    if (*identity != identity_of(sweep))
      throw FileError(sweep.file + " means another sweep on this machine than on that of rank 0");
    const SweepRows rows(sweep, sweep.evaluation);
    SweepWorkers workers(sweep, *identity, rows, threads_of(sweep), {});
    master.tell({.what = FromPeer::What::kReady, .threads = workers.threads(), .done = {}});
    work_for(master, workers);
  } catch (const Error& e) {
    master.tell({.what = FromPeer::What::kFailed, .done = {0, e.what()}});
    await_dismissal(master);
  }
}

}  // namespace dyntape
