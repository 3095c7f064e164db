// SPDX-License-Identifier: BSD-3-Clause
//
// Passes the latest value from one thread to another; neither thread waits.
//
//   TripleBuffer<Plan> latest;
//   latest.write() = plan, latest.publish();              // in one thread, at any rate
//   if (latest.take()) use(latest.read());          // in another thread; false: nothing new
//
// Three values: one being written, one being read, and one that is exchanged atomically.
#pragma once

#include <array>
#include <atomic>

namespace dyntape {

template <class T>
class TripleBuffer {
 public:
  T& write() { return values_[writing_]; }
  void publish() { writing_ = between_.exchange(writing_ | kNew, std::memory_order_acq_rel) & kIndex; }

  bool take() {
    if (!(between_.load(std::memory_order_relaxed) & kNew)) return false;
    reading_ = between_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  const T& read() const { return values_[reading_]; }

 private:
  static constexpr unsigned kNew = 4, kIndex = 3;
  static_assert(std::atomic<unsigned>::is_always_lock_free);

  std::array<T, 3> values_ = {};
  unsigned writing_ = 0, reading_ = 1;
  std::atomic<unsigned> between_ = 2;
};

}  // namespace dyntape
