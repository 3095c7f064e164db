// SPDX-License-Identifier: BSD-3-Clause
//
// Shows the progress of long work on stderr: on a terminal one line that is redrawn, elsewhere a line every few
// seconds, so that a log of hours is short and short work logs nothing.
//
//   LiveLine line;
//   for (int i = 0; i < n; ++i) line.show("iteration " + std::to_string(i));      // often costs nothing
//
// On a terminal the line is erased when the object is destroyed.  Not thread-safe.
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
  std::chrono::milliseconds pause_;  // between two lines, and before the first plain one
  std::chrono::steady_clock::time_point last_;
  bool drawn_ = false;
};

}  // namespace dyntape::io
