// SPDX-License-Identifier: BSD-3-Clause
//
// Which of two ways is quicker, by more than the noise of a machine that does other things as well.
//
//   is_quicker(1.9e-3, 2.1e-3)                     // by figures, which may be noise
//   is_quicker([&] { return seconds_of(a); }, [&] { return seconds_of(b); })      // measured in turn
#pragma once

#include <functional>

namespace dyntape::tools {

// By figures that may be noise.
inline bool is_quicker(double seconds, double than) { return seconds < 0.95 * than; }

// Doing it once more (s).
using Timed = std::function<double()>;

// Whether one is quicker than another by more than noise: in each of seven turns, of three where they take two seconds, and by a
// twentieth in all.
inline bool is_quicker(const Timed& one, const Timed& than) {
  constexpr int kTurns = 7;
  constexpr double kPatience = 2;  // s
  double seconds = 0, others = 0;
  for (int turn = 0; turn < kTurns; ++turn) {
    double its = 0, other = 0;
    for (const bool is_first : {turn % 2 == 0, turn % 2 != 0})
      (is_first ? its : other) = (is_first ? one : than)();
    if (!(its < other)) return false;
    seconds += its, others += other;
    if (turn > 1 && seconds + others > kPatience) break;
  }
  return is_quicker(seconds, others);
}

}  // namespace dyntape::tools
