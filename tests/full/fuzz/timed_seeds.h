// SPDX-License-Identifier: BSD-3-Clause
//
// Hands out seeds until the time is over, the first one in any case.  Threads may share it.
//
//   TimedSeeds seeds(first, 20.0);                      // seconds
//   for (std::uint64_t seed; seeds.take(seed);) ...     // first, first + 1, ...
//   seeds.taken();                                      // how many that were
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace dyntape::testing {

class TimedSeeds {
 public:
  using Clock = std::chrono::steady_clock;

  TimedSeeds(std::uint64_t first, double seconds)
      : first_(first),
        next_(first),
        end_(Clock::now() +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))) {}

  bool take(std::uint64_t& seed) {
    if (next_ > first_ && Clock::now() > end_) return false;
    seed = next_++;
    return true;
  }

  std::uint64_t taken() const { return next_ - first_; }

 private:
  const std::uint64_t first_;
  std::atomic<std::uint64_t> next_;
  const Clock::time_point end_;
};

}  // namespace dyntape::testing
