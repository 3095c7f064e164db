// SPDX-License-Identifier: BSD-3-Clause
//
// Runs a sweep, or resumes an interrupted one, to its results.
//
//   const SceneSweep sweep = read_sweep("config/sweeps/quadruped_dropped.info");
//   const SweepOutcome outcome = run_sweep(sweep, "out/drop");
//   outcome.table.column("most.v")
//
// Chunks of rows are distributed over threads and over the processes of `watch.peers`.  The bytes of a chunk do not
// depend on who computed it.  Only this process writes.  At the end, chunks that a peer has not returned are also
// computed here, and count once.
//
// Errors.  Those of SweepFolder and of compilation, and errors that a peer reports.
#pragma once

#include <functional>
#include <stop_token>

#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/run/sweep/sweep_workers.h>

namespace dyntape {

struct SweepOutcome {
  io::CsvTable table;                 // sweep.csv; empty if the sweep was stopped
  std::string csv, identity;          // its text
  std::vector<std::string> failures;  // "sample 17: ended at t = ..."
  long rows = 0, resumed = 0;         // rows present; rows present before
  bool was_stopped = false, was_finished = false;
  std::size_t operations = 0;                  // of one step
  double build_seconds = 0, step_seconds = 0;  // recording, compiling and loading; all else
};

struct SweepProgress {
  long rows = 0, of = 0, resumed = 0;
  double seconds = 0;        // since the first row
  std::string text() const;  // "[####....] 50 %, 500 of 1000 samples, 120 a second, 4.2 s left"
};

struct SweepWatch {
  std::stop_token stop = {};
  std::function<void(const std::string&)> tell = {};
  SweepPeers* peers = nullptr;
};

// The chunks stay; the writer of the results clears them.
SweepOutcome run_sweep(const SceneSweep& sweep, SweepFolder& folder, const SweepWatch& watch = {});

}  // namespace dyntape
