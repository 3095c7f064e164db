// SPDX-License-Identifier: BSD-3-Clause
//
// Who computes the chunks of a sweep: threads of this process, and processes elsewhere.
//
//   SweepWorkers workers(sweep, identity, rows, threads, stop);
//   workers.give(12);
//   while (auto done = workers.take(100ms)) folder.keep(done->chunk, done->text);
//
// SweepPeers is how the process that writes reaches others, SweepCoordinator how those reach it; tools/mpi has both.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <dyntape/interface/run/sweep/sweep_folder.h>

namespace dyntape {

struct DoneChunk {
  long chunk = 0;
  std::string text;
};

class SweepWorkers {
 public:
  SweepWorkers(const SceneSweep& sweep, std::string identity, const SweepRows& rows, unsigned threads,
               std::stop_token stop);
  ~SweepWorkers();  // stops its threads
  SweepWorkers(const SweepWorkers&) = delete;
  SweepWorkers& operator=(const SweepWorkers&) = delete;

  unsigned threads() const { return unsigned(threads_.size()); }
  long waiting() const;  // chunks that were given and not taken
  void give(long chunk);
  // Waits so long at most.  Throws what ended a thread.
  std::optional<DoneChunk> take(std::chrono::milliseconds patience);

 private:
  void work(SweepRows& rows);
  std::optional<long> next();

  const SceneSweep& sweep_;
  const std::string identity_;
  std::stop_source over_;
  mutable std::mutex mutex_;
  std::condition_variable_any given_, done_;
  std::deque<long> todo_;
  std::deque<DoneChunk> finished_;
  std::exception_ptr failure_;
  long waiting_ = 0;
  std::vector<std::jthread> threads_;
  std::optional<std::stop_callback<std::function<void()>>> stopped_;
};

// What another process tells the one that writes.
struct FromPeer {
  enum class What { kReady, kDone, kFailed };
  int peer = 0;
  What what = What::kReady;
  unsigned threads = 0;  // ready: so many chunks at a time
  DoneChunk done;        // done; failed: its text is the sentence
};

class SweepPeers {
 public:
  virtual ~SweepPeers() = default;
  virtual int count() const = 0;
  virtual void begin(const std::string& identity) = 0;  // the functions are compiled: all may load them
  virtual void give(int peer, long chunk) = 0;
  virtual void dismiss() = 0;
  virtual std::optional<FromPeer> poll() = 0;  // does not wait
};

class SweepCoordinator {
 public:
  virtual ~SweepCoordinator() = default;
  virtual std::optional<std::string> begin() = 0;  // waits for the identity of the sweep; none: dismissed
  virtual void tell(const FromPeer& news) = 0;
  struct Order {
    bool is_dismissed = false;
    long chunk = 0;
  };
  virtual std::optional<Order> poll() = 0;
};

// The work of a process that does not write, until it is dismissed: it reads the file itself.
void serve_sweep(const std::string& file, const std::vector<io::Setting>& settings, SweepCoordinator& master);

unsigned threads_of(const SceneSweep& sweep);

}  // namespace dyntape
