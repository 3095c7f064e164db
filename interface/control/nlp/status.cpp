// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/nlp/status.h>

namespace dyntape {

namespace {

struct Words {
  SolveStatus status;
  const char* name;
  const char* sentence;
};

constexpr Words kWords[] = {
    {SolveStatus::kSolved, "solved", "A local optimum was found to the requested tolerance."},
    {SolveStatus::kAcceptable, "acceptable",
     "The solver stalled: the point is optimal to its looser, acceptable tolerance only, not to the "
     "requested "
     "one."},
    {SolveStatus::kSettled, "settled", "The cost hardly changes any more; the point is not optimal yet."},
    {SolveStatus::kLocallyInfeasible, "locally infeasible",
     "The solver converged to a point where the violation of the constraints is locally least; the problem "
     "is "
     "locally infeasible there, and a feasible point may exist elsewhere: try another start."},
    {SolveStatus::kIterationLimit, "iteration limit", "The limit on iterations was reached."},
    {SolveStatus::kTimeLimit, "time limit", "The limit on time was reached."},
    {SolveStatus::kDiverging, "diverging",
     "The iterates grow without bound: the problem may be unbounded below."},
    {SolveStatus::kStepTooSmall, "step too small",
     "No step makes progress within rounding although no tolerance is met: the problem may be badly scaled."},
    {SolveStatus::kRestorationFailed, "restoration failed",
     "The solver could approach neither the constraints nor a point of locally least violation."},
    {SolveStatus::kStepFailed, "step failed", "The linear system of a step could not be solved."},
    {SolveStatus::kTooFewVariables, "too few variables",
     "There are fewer free variables than equality constraints: use more intervals or fix less."},
    {SolveStatus::kNotFinite, "not finite",
     "The functions of the problem gave no finite number at a point where the solver needs one."},
    {SolveStatus::kStopped, "stopped", "The solve was stopped on request."},
    {SolveStatus::kBadOption, "bad option", "The solver refuses an option or a pair of bounds."},
    {SolveStatus::kSolverError, "solver error", "The solver gave up for a reason of its own."},
};

const Words& words(SolveStatus status) {
  for (const Words& w : kWords) {
    if (w.status == status) return w;
  }
  return kWords[sizeof(kWords) / sizeof(kWords[0]) - 1];
}

}  // namespace

const char* to_string(SolveStatus status) { return words(status).name; }
const char* describe(SolveStatus status) { return words(status).sentence; }

bool is_stuck(SolveStatus status) {
  return status == SolveStatus::kLocallyInfeasible || status == SolveStatus::kRestorationFailed ||
         status == SolveStatus::kStepTooSmall || status == SolveStatus::kStepFailed;
}

}  // namespace dyntape
