// SPDX-License-Identifier: BSD-3-Clause
//
// The results of a sweep, a row a sample, computed some at a time.
//
//   SweepRows rows(sweep, options);                 // recorded, compiled; rows.twin() for another thread
//   rows.compute(first, count, stop)->text          // lines as sweep.csv has them
//
// Columns: sample; what varies; ok, 1 where the motion came to its end by steps that can be trusted, else 0; t, the time
// that was reached (s); q and v there, named as in motion.csv; energy.kinetic and energy.stored there (J); most.energy, the
// largest sum of both at the samples of the scene; most.v, the largest entry of v at any step.  Of a motion that left the
// finite numbers it is the last state that was finite; what is beyond the doubles stands there as the largest of them.
//
// The same bits for any number of lanes, threads and rows at a time, in the strict profile.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include <dyntape/interface/files/sweep/sweep.h>

namespace dyntape {

// How many are computed at a time: about half a second's work, and not so many that threads have none.
long rows_at_a_time(const SceneSweep& sweep);

struct ComputedRows {
  std::string text;                   // a line a row, each ended
  std::vector<std::string> failures;  // "sample 17: at t = ..."
};

class SweptFunctions;

class SweepRows {
 public:
  SweepRows(const SceneSweep& sweep, const CodegenOptions& options);
  ~SweepRows();
  SweepRows(SweepRows&&) noexcept;
  SweepRows twin() const;

  std::optional<ComputedRows> compute(long first, long count, const std::stop_token& stop);  // none: stopped

  std::size_t operations() const;  // of one step

 private:
  explicit SweepRows(std::unique_ptr<SweptFunctions> functions);
  std::unique_ptr<SweptFunctions> functions_;
};

}  // namespace dyntape
