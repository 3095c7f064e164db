// SPDX-License-Identifier: BSD-3-Clause
//
// A finished sweep, written down.
//
//   SweepReport report{sweep, run_sweep(sweep, folder)};
//   write_sweep_results(report, "out/drop");
//   std::cout << report.text();
//
// write_sweep_results leaves in the folder, each file whole or not at all:
//   sweep.csv       a row a sample (sweep_rows.h)
//   failures.txt    a line for each sample whose row is not ok, if there is any: what happened
//   effective.info  the sweep as it was understood, defaults included
//   sweep.svg       results over what varies, and how they are distributed
//   report.json     everything below, for programs; written last
#pragma once

#include <stop_token>

#include <dyntape/interface/report/plot/picture.h>
#include <dyntape/interface/run/sweep/run_sweep.h>

namespace dyntape {

struct SweepReport {
  const SceneSweep& sweep;
  SweepOutcome outcome;
  std::vector<std::string> unwritten = {};  // why results are not where they belong, a sentence each

  bool success() const;         // it came to its end, and not every sample failed
  std::string verdict() const;  // one sentence
  std::string text() const;     // for people
  std::string json() const;     // for programs
};

// What cannot be written stands in report.unwritten.
void write_sweep_results(SweepReport& report, const std::string& folder, const std::stop_token& stop = {});

// Of results that an earlier run has written.
SweepOutcome finished_outcome(const SceneSweep& sweep, const std::string& folder);

// Of the samples that are ok.
struct Quantiles {
  double least = 0, low = 0, median = 0, high = 0, most = 0;  // low, high: of 5 and 95 %
};
Quantiles quantiles_of(std::vector<double> values);
io::Plot sweep_plot(const SceneSweep& sweep, const io::CsvTable& table);

}  // namespace dyntape
