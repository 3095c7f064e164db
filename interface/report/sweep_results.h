// SPDX-License-Identifier: BSD-3-Clause
//
// Writes the results of a sweep: a table, plots and a report.
//
//   SweepReport report{sweep, run_sweep(sweep, folder)};
//   write_sweep_results(report, "out/drop");
//   std::cout << report.text();
//
// write_sweep_results writes these files into the folder, each atomically:
//   sweep.csv       one row per sample (sweep_rows.h)
//   failures.txt    one line per failed sample with the reason, if any
//   effective.info  the sweep with all defaults
//   sweep.svg       results over the varied values, and their distributions
//   report.json     all results, for programs; written last
#pragma once

#include <stop_token>

#include <dyntape/interface/report/plot/picture.h>
#include <dyntape/interface/run/sweep/run_sweep.h>

namespace dyntape {

struct SweepReport {
  const SceneSweep& sweep;
  SweepOutcome outcome;
  std::vector<std::string> unwritten = {};  // files that could not be written, with the reason

  bool success() const;         // the sweep is complete, and not every sample failed
  std::string verdict() const;  // one sentence
  std::string text() const;     // for people
  std::string json() const;     // for programs
};

// Failures are listed in report.unwritten.
void write_sweep_results(SweepReport& report, const std::string& folder, const std::stop_token& stop = {});

// Reads the outcome that an earlier run wrote.
SweepOutcome finished_outcome(const SceneSweep& sweep, const std::string& folder);

// Quantiles of the successful samples.
struct Quantiles {
  double least = 0, low = 0, median = 0, high = 0, most = 0;  // low, high: 5 and 95 %
};
Quantiles quantiles_of(std::vector<double> values);
io::Plot sweep_plot(const SceneSweep& sweep, const io::CsvTable& table);

}  // namespace dyntape
