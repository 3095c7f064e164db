// SPDX-License-Identifier: BSD-3-Clause
//
// One optimal control problem from many starts, with many parameters, from many first guesses: solved side by side by differential
// dynamic programming (solve/ddp.h), a problem a lane of the processor's registers, and in threads above.
//
//   DdpBatch batch(problem, {.intervals = 100, .verify = false});        // recorded and compiled once
//   std::vector<DdpSolution> s = batch.solve({.starts = starts});        // (n_x x count), a column a problem
//   s[3].success(), s[3].u, s[3].policy[0].K                             // as of DdpSolver; du(0)/dx(0) of an exact solution
//
//   batch.solve({.starts = starts, .parameters = values});               // (n_p x count), held over time; Parameters::entry_names()
//   batch.solve({.starts = starts, .controls = guesses});                // (n_u N x count): u_0, u_1, ... of each
//
//   DdpBatch batch(problem, {.intervals = 100, .sensitivities = SensitivitiesOf::kMotion});
//   batch.solve({.starts = starts})[3].sensitivities.parameters.x                      // dx/dp of each (solve/ddp_sensitivities.h)
//
// What is left out is the problem's own (solver().problem()): its parameters, which may be functions of time, its guess, its
// start for all, where only parameters or controls are given.
//
// Each solve takes the course that DdpSolver takes, to rounding: the same rules of steps, stopping, saddles and limits.  Its bits
// depend on its own values alone: not on how many there are, which are beside it, or on the number of threads.  Three problems
// a lane are in flight, so that all lanes find some that ask for the same work; one that is done makes room for the next.
//
// A solve that fails is a status of its own and takes nothing from the others.  Besides what DdpSolver says: kNotFinite where the motion
// is not finite at the start or leaves a branch that was recorded there.  `seconds` is each one's share of the call; max_seconds
// counts what its lane's thread has run since it began; watch is not called.
//
// With functions of several lanes (evaluation.lanes, as is the default) and kPortable functions it is quickest.
//
// Errors: ArgumentError for a problem that the method does not know, for values of other sizes or that are not finite, naming the column.
#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include <dyntape/interface/control/batch/batch_values.h>
#include <dyntape/interface/control/solve/ddp.h>

namespace dyntape {

class DdpBatch {
 public:
  // threads: of the process (codegen/run/threads.h) that share the problems; 0: as many as it has.
  explicit DdpBatch(const Problem& problem, const DdpOptions& options = {}, unsigned threads = 1);
  DdpBatch(DdpBatch&&) noexcept;
  DdpBatch& operator=(DdpBatch&&) noexcept;
  ~DdpBatch();

  std::vector<DdpSolution> solve(const DdpBatchValues& values, const std::stop_token& stop = {}) const;
  int lanes() const;  // problems side by side in a thread
  // One at a time with the same functions, and the values that hold where a batch leaves them out: set_values().
  DdpSolver& solver();
  const DdpSolver& solver() const;

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
