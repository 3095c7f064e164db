// SPDX-License-Identifier: BSD-3-Clause
//
// Solves one optimal control problem for many starts, parameters or initial guesses by differential dynamic
// programming (solve/ddp.h).  Each SIMD lane solves one problem; threads share the problems.
//
//   DdpBatch batch(problem, {.intervals = 100, .verify = false});        // recorded and compiled once
//   std::vector<DdpSolution> s = batch.solve({.starts = starts});        // (n_x x count), one problem per column
//   s[3].success(), s[3].u, s[3].policy[0].K                             // as from DdpSolver; K = du(0)/dx(0) if exact
//
//   batch.solve({.starts = starts, .parameters = values});               // (n_p x count), constant in time
//   batch.solve({.starts = starts, .controls = guesses});                // (n_u N x count): u_0, u_1, ... per column
//
//   DdpBatch batch(problem, {.intervals = 100, .sensitivities = SensitivitiesOf::kMotion});
//   batch.solve({.starts = starts})[3].sensitivities.parameters.x        // dx/dp (solve/ddp_sensitivities.h)
//
// Values that are not given come from the problem, solver().problem(): parameters (also functions of time), initial
// guess, and start.
//
// Each solve follows the algorithm of DdpSolver, with the same rules for steps, stopping, saddles and limits;
// results agree to rounding.  The bits of a result depend on its own values only, not on the number of problems,
// neighbours or threads.  Each lane has three problems in progress, so that problems in the same phase run together.
// A finished problem is replaced by the next.
//
// A failed solve has its own status and does not affect the others.  Differences from DdpSolver:
//
// - kNotFinite: the initial trajectory is not finite, or takes another branch than the recording.
// - `seconds` is the share of the call's time; max_seconds counts the time of the thread since its start.
// - `watch` is not called.
//
// Fastest with functions of several lanes (evaluation.lanes, the default) and with kPortable functions.
//
// Errors.  ArgumentError, with the column: a problem that the method does not support, values of wrong size or not
// finite.
#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include <dyntape/interface/control/batch/batch_values.h>
#include <dyntape/interface/control/solve/ddp.h>

namespace dyntape {

class DdpBatch {
 public:
  // threads: threads of the process (codegen/run/threads.h) that share the problems; 0: all.
  explicit DdpBatch(const Problem& problem, const DdpOptions& options = {}, unsigned threads = 1);
  DdpBatch(DdpBatch&&) noexcept;
  DdpBatch& operator=(DdpBatch&&) noexcept;
  ~DdpBatch();

  std::vector<DdpSolution> solve(const DdpBatchValues& values, const std::stop_token& stop = {}) const;
  int lanes() const;  // problems in parallel per thread
  // The solver for single problems, with the same functions.  Its set_values() sets the values that a batch does
  // not.
  DdpSolver& solver();
  const DdpSolver& solver() const;

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
