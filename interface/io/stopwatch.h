// SPDX-License-Identifier: BSD-3-Clause
//
// Measures elapsed time.
//
//   const auto begin = std::chrono::steady_clock::now();
//   ...
//   report.seconds = seconds_since(begin);
//
//   const Stopwatch watch(times.functions, times.function_calls);      // adds the time of the block, and one call
#pragma once

#include <chrono>
#include <ctime>

namespace dyntape {

inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

class Stopwatch {
 public:
  Stopwatch(double& seconds, int& calls) : seconds_(seconds), begin_(std::chrono::steady_clock::now()) {
    ++calls;
  }
  ~Stopwatch() { seconds_ += seconds_since(begin_); }

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point begin_;
};

// Processor time of this thread.
inline double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

}  // namespace dyntape
