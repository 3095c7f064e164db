// SPDX-License-Identifier: BSD-3-Clause
//
// A sweep from its beginning, or from where it was left, to its results.
//
//   const SceneSweep sweep = read_sweep("config/sweeps/quadruped_dropped.info");
//   const SweepOutcome outcome = run_sweep(sweep, "out/drop");
//   outcome.table.column("most.v")
//
// Chunks of rows are shared out among threads, and among the processes of `watch.peers`; whoever has computed a chunk, its
// bytes are the same.  This process alone writes.  Chunks of a peer that is silent are computed here as well when nothing
// else is left, and count once.
//
// Errors: those of SweepFolder, of compiling, and what a peer says has ended it.
#pragma once

#include <functional>
#include <stop_token>

#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/run/sweep/sweep_workers.h>

namespace dyntape {

struct SweepOutcome {
  io::CsvTable table;                 // sweep.csv; empty where it was stopped
  std::string csv, identity;          // its text
  std::vector<std::string> failures;  // "sample 17: ended at t = ..."
  long rows = 0, resumed = 0;         // that are there; that were there before
  bool was_stopped = false, was_finished = false;
  std::size_t operations = 0;                  // of one step
  double build_seconds = 0, step_seconds = 0;  // of recording, compiling and loading; of all else
};

struct SweepProgress {
  long rows = 0, of = 0, resumed = 0;
  double seconds = 0;        // since the first was begun
  std::string text() const;  // "[####....] 50 %, 500 of 1000 samples, 120 a second, 4.2 s left"
};

struct SweepWatch {
  std::stop_token stop = {};
  std::function<void(const std::string&)> tell = {};
  SweepPeers* peers = nullptr;
};

// The chunks stay: whoever has written the results clears them.
SweepOutcome run_sweep(const SceneSweep& sweep, SweepFolder& folder, const SweepWatch& watch = {});

}  // namespace dyntape
