// SPDX-License-Identifier: BSD-3-Clause
//
// The status of a finished solve.  Only kSolved is success.
//
//   if (solution.status != SolveStatus::kSolved) std::cerr << describe(solution.status) << "\n";
#pragma once

namespace dyntape {

enum class SolveStatus {
  kSolved,             // first-order optimality to the requested tolerance
  kAcceptable,         // stalled above that tolerance, within the solver's looser acceptable one
  kSettled,            // stopped early as requested: the cost hardly changed (settling.h)
  kLocallyInfeasible,  // a point where the constraint violation is *locally* least; feasible ones may exist
  kIterationLimit,     // stopped by the limit on iterations
  kTimeLimit,          // stopped by the limit on time
  kDiverging,          // iterates grow without bound: the problem may be unbounded below
  kStepTooSmall,       // no step makes progress within rounding, above every tolerance
  kRestorationFailed,  // neither the optimum nor a point of least violation could be approached
  kStepFailed,         // the linear system of the step could not be solved
  kTooFewVariables,    // fewer free variables than equality constraints
  kNotFinite,          // the problem's functions gave no finite number where one was needed
  kStopped,            // the caller asked to stop
  kBadOption,          // the solver refuses an option or a bound
  kSolverError,        // another failure of the solver (memory, internal error)
};

const char* to_string(SolveStatus status);  // "solved", "locally infeasible", ...: for reports and scripts
const char* describe(SolveStatus status);   // one sentence
// Returns true if the method failed, which says more about the method than about the program.
bool is_stuck(SolveStatus status);

}  // namespace dyntape
