// SPDX-License-Identifier: BSD-3-Clause
//
// Computes the results of a sweep, one row per sample, some rows at a time.
//
//   SweepRows rows(sweep, options);                 // records, compiles; rows.twin() for another thread
//   rows.compute(first, count, stop)->text          // lines of sweep.csv
//
// Columns: sample; varied values; ok, 1 if the motion is complete with valid steps, else 0; t, the final time (s); q
// and v at this time, with the names of motion.csv; energy.kinetic and energy.stored (J); most.energy, the largest
// sum of both at the samples of the scene; most.v, the largest entry of v at any step.  If a motion is no longer
// finite, the row has its last finite state; values beyond the range of double are the largest double.
//
// The bits do not depend on lanes, threads and the number of rows per call.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include <dyntape/interface/files/sweep/sweep.h>

namespace dyntape {

// Rows per call: about half a second of work, but few enough for all threads.
long rows_at_a_time(const SceneSweep& sweep);

struct ComputedRows {
  std::string text;                   // one line per row, each with line end
  std::vector<std::string> failures;  // "sample 17: at t = ..."
};

class SweptFunctions;

class SweepRows {
 public:
  SweepRows(const SceneSweep& sweep, const CodegenOptions& options);
  ~SweepRows();
  SweepRows(SweepRows&&) noexcept;
  SweepRows twin() const;

  std::optional<ComputedRows> compute(long first, long count,
                                      const std::stop_token& stop);  // nullopt: stopped

  std::size_t operations() const;  // of one step

 private:
  explicit SweepRows(std::unique_ptr<SweptFunctions> functions);
  std::unique_ptr<SweptFunctions> functions_;
};

}  // namespace dyntape
