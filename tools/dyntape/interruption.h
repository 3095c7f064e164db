// SPDX-License-Identifier: BSD-3-Clause
//
// Ctrl-C as a request: the work ends in its own time, what it has is written, what it has started is ended.
//
//   Interruption interruption([] { return there_is_nothing_to_save(); });
//   work(interruption.token());
//   if (interruption.status()) throw Failure{interruption.status()};
//
// SIGINT, SIGTERM and SIGHUP count, except those that the process was started to ignore.  The second signal ends the
// process at once.  If there is nothing to save, the first ends it within a tenth of a second, or when the folders of
// compilers are removed.  Compilers end with the process (codegen/system/process.h).  Create it before other threads.
#pragma once

#include <signal.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <stop_token>
#include <thread>

#include <dyntape/codegen/system/files.h>

namespace dyntape::tools {

class Interruption {
 public:
  // `nothing_to_save` is called from another thread.
  explicit Interruption(std::function<bool()> nothing_to_save);
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  std::stop_token token() const { return stop_.get_token(); }
  int status() const;  // 128 + the signal that came; 0: none did

 private:
  void wait();
  void note(int signal);

  std::function<bool()> nothing_to_save_;
  std::stop_source stop_;
  std::atomic<int> signal_ = 0;
  std::chrono::steady_clock::time_point noted_;
  sigset_t before_{};
  codegen::Descriptor signals_, over_;  // readable when a signal came, when this object goes
  std::jthread thread_;
};

}  // namespace dyntape::tools
