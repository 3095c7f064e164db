// SPDX-License-Identifier: BSD-3-Clause
//
// The workers of a sweep: threads of this process, and other processes.
//
//   SweepWorkers workers(sweep, identity, rows, threads, stop);
//   workers.give(12);
//   while (auto done = workers.take(100ms)) folder.keep(done->chunk, done->text);
//
// SweepPeers connects the writing process to the others, SweepCoordinator connects these to it; tools/mpi implements
// both.
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
  long waiting() const;  // chunks given and not yet taken
  void give(long chunk);
  // Waits at most this time.  Rethrows the exception that ended a thread.
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

// A message from another process to the writing process.
struct FromPeer {
  enum class What { kReady, kDone, kFailed };
  int peer = 0;
  What what = What::kReady;
  unsigned threads = 0;  // ready: number of chunks at a time
  DoneChunk done;        // done; if failed, its text is the message
};

class SweepPeers {
 public:
  virtual ~SweepPeers() = default;
  virtual int count() const = 0;
  virtual void begin(const std::string& identity) = 0;  // the functions are compiled; others may load them
  virtual void give(int peer, long chunk) = 0;
  virtual void dismiss() = 0;
  virtual std::optional<FromPeer> poll() = 0;  // returns at once
};

class SweepCoordinator {
 public:
  virtual ~SweepCoordinator() = default;
  virtual std::optional<std::string> begin() = 0;  // waits for the identity of the sweep; nullopt: dismissed
  virtual void tell(const FromPeer& news) = 0;
  struct Order {
    bool is_dismissed = false;
    long chunk = 0;
  };
  virtual std::optional<Order> poll() = 0;
};

// The work of a process that does not write, until it is dismissed.  It reads the sweep file itself.
void serve_sweep(const std::string& file, const std::vector<io::Setting>& settings, SweepCoordinator& master);

unsigned threads_of(const SceneSweep& sweep);

}  // namespace dyntape
