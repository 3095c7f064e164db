// SPDX-License-Identifier: BSD-3-Clause
//
// Runs programs without a shell and without our file descriptors, with limits of time and memory.  A program gets
// PATH, HOME and TMPDIR of our environment; messages are in English.  If this process ends, the programs and their
// children end too.
//
//   std::vector<Outcome> done = run_all({{{"/usr/bin/cc", "-c", "a.c"}}}, {2, 60.0, 4ull << 30});
//   done[0].status                  exit status; 128 + number if a signal ended it; kTimedOut, ...
//   done[0].output                  what it wrote to stdout and stderr
//
// A failing program throws nothing: the caller interprets the status.
#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

namespace dyntape::codegen {

struct Command {
  std::vector<std::string> arguments;  // the program first, with its path
  std::string log;                     // a file that receives stdout and stderr; empty: memory
  std::string temporary_folder;        // $TMPDIR of the program; empty: ours
};

struct Bounds {
  unsigned jobs = 1;               // programs at a time
  double seconds = 600;            // for each program; a program that takes longer ends all
  std::size_t bytes = 8ull << 30;  // address space of each
  std::stop_token stop = {};       // a request ends running programs and starts no others
  std::function<void(std::size_t ended)> on_end =
      {};  // called after programs have ended, with their number so far
};

struct Outcome {
  static constexpr int kNotStarted = 127;
  static constexpr int kTimedOut = 124;
  static constexpr int kStopped = 125;
  static constexpr int kUnknown = -1;  // the host ignores its children (SIGCHLD): check the output files
  int status = kNotStarted;
  std::string output;
};

std::vector<Outcome> run_all(const std::vector<Command>& commands, const Bounds& bounds);

// The command as a person would type it.
std::string to_text(const std::vector<std::string>& arguments);

}  // namespace dyntape::codegen
