// SPDX-License-Identifier: BSD-3-Clause
//
// The solution of a nonlinear program: point, multipliers, status, log and times.
//
//   if (s.status == SolveStatus::kSolved) use(s.x, s.objective);
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/control/nlp/nlp.h>
#include <dyntape/interface/control/nlp/status.h>

namespace dyntape {

enum class NlpMethod {
  // kRiccati; kIpopt if only Ipopt can solve it: limited memory, Ipopt's options and prints, programs without stages.
  kAutomatic,
  kRiccati,  // the stage-wise method of dyntape (interior_point.h)
  kIpopt,    // Ipopt and a general sparse solver (ipopt.h)
};
inline const char* to_string(NlpMethod m) {
  return m == NlpMethod::kIpopt ? "ipopt" : m == NlpMethod::kRiccati ? "riccati" : "automatic";
}

// One line of the solver's log.
struct IterationRecord {
  int iteration;
  double objective, primal_infeasibility, dual_infeasibility;
  double barrier, step_norm, regularization, dual_step, primal_step;
  int line_search_trials;
  bool restoration;
};

// Seconds of wall time (`processor`: of all threads together), and the number of evaluations.
struct SolveTimes {
  double total = 0, processor = 0, functions = 0, jacobian = 0, hessian = 0;
  int function_calls = 0, jacobian_calls = 0, hessian_calls = 0;
  double solver() const { return total - functions - jacobian - hessian; }  // linear algebra and all else
  SolveTimes& operator+=(const SolveTimes& more) {
    total += more.total, processor += more.processor;
    functions += more.functions, jacobian += more.jacobian, hessian += more.hessian;
    function_calls += more.function_calls, jacobian_calls += more.jacobian_calls,
        hessian_calls += more.hessian_calls;
    return *this;
  }
};

// Whether a stationary point is a minimum (second_order.h).
enum class StationaryPoint { kUnknown, kMinimum, kNotMinimum };

// One start of one method.  A solve has several if the first fails or ends at a saddle point.
struct SolveAttempt {
  NlpMethod method;
  std::string start;  // "the guess", "beside a saddle point"
  int iterations;
  SolveStatus status;
  double objective;  // final value
};

struct NlpSolution {
  SolveStatus status = SolveStatus::kSolverError;
  double objective = 0;
  std::vector<double> x;                                   // (n)
  std::vector<double> g, lambda;                           // (m): lambda > 0 if g is at its upper bound
  std::vector<double> lower_multiplier, upper_multiplier;  // (n): >= 0, multipliers of x_lower and x_upper
  std::vector<IterationRecord> log;                        // iteration 0 is the start
  NlpScaling units;                                        // nominal values of the last round
  SolveTimes times;
  std::vector<SolveAttempt> attempts = {};   // in order; iterations() is their sum
  NlpMethod method = NlpMethod::kAutomatic;  // the method that found x
  bool is_by_other_method = false;  // true: the first method failed, the other one found x (solver_options.h)
  StationaryPoint stationary_point = StationaryPoint::kUnknown;  // if solved or acceptable

  int iterations() const { return log.empty() ? 0 : log.back().iteration; }
};

}  // namespace dyntape
