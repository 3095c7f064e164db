// SPDX-License-Identifier: BSD-3-Clause
//
// What long work is doing now, on stderr: one line that is drawn anew on a terminal, a plain line every few seconds
// elsewhere, so that a log of hours stays short and work of less leaves none.
//
//   LiveLine line;
//   for (int i = 0; i < n; ++i) line.show("iteration " + std::to_string(i));      // often costs nothing
//
// On a terminal nothing is left of it when it goes out of scope.  Not for several threads at once.
#pragma once

#include <chrono>
#include <string>

namespace dyntape::io {

class LiveLine {
 public:
  enum class Kind { kTerminal, kPlain };

  LiveLine();  // as stderr is
  explicit LiveLine(Kind kind, std::chrono::milliseconds pause);
  ~LiveLine();
  LiveLine(const LiveLine&) = delete;
  LiveLine& operator=(const LiveLine&) = delete;

  void show(const std::string& text);
  void erase();

 private:
  Kind kind_;
  std::chrono::milliseconds pause_;  // between two lines, and ahead of the first plain one
  std::chrono::steady_clock::time_point last_;
  bool drawn_ = false;
};

}  // namespace dyntape::io
