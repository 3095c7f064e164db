// SPDX-License-Identifier: BSD-3-Clause
//
// One line on stderr that says how far long work has come; silent unless stderr is a terminal.
//
//   Progress progress("compiling", 12);
//   for (int i = 0; i < 12; ++i) {
//     compile(i);
//     progress.update(i + 1, names[i]);      // compiling [=======>            ]  5/12  aba_3.c
//   }                                        // the line is erased when progress goes out of scope
//
// Redrawn at most twenty times a second, so that updating often costs nothing.  Not for several threads at
// once.
#pragma once

#include <chrono>
#include <string>

namespace dyntape::io {

class Progress {
 public:
  enum class Show { kIfTerminal, kAlways, kNever };

  // total 0: unknown, a count is shown instead of a bar.
  Progress(std::string what, long total, Show show = Show::kIfTerminal);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(long done, const std::string& note = "");

  // The line for a terminal of the given width, without control characters.
  static std::string line(const std::string& what, long done, long total, const std::string& note, int width);

 private:
  void erase();

  std::string what_;
  long total_;
  bool shown_, drawn_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace dyntape::io
