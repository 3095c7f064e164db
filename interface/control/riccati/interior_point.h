// SPDX-License-Identifier: BSD-3-Clause
//
// A primal-dual interior-point method for programs whose variables form a chain of stages (NlpShape::stages).  Its
// linear systems take time linear in the number of stages (riccati_kkt.h).  It has no static state, so several
// solves may run at once.
//
//   NlpSolution s = solve_with_riccati(problem, start, {.tolerance = 1e-10});
//   if (s.status == SolveStatus::kSolved) use(s.x, s.objective);
//
// Programs, units, rounds, tolerances and statuses are as with Ipopt (ipopt.h); only the steps are computed
// differently.
//
// Method.  Slacks and logarithmic barriers, primal and dual Newton steps, a filter line search with second-order
// corrections.
//
// - The barrier parameter decreases when its problem is solved to a fraction of the parameter.  At first it
// increases, tenfold and at most twice, if bounds cut three steps in a row to less than a tenth: an arm within its
// limits took 52 iterations without this, 38 with it.
// - If the reduced Hessian is not positive definite, the Hessian is regularised until it is.
// - If no step succeeds, the sum of squared constraint violations is minimised until the filter accepts the point
// (restoration).  If this has a nonzero minimum, the program is locally infeasible.
//
// max_seconds is processor time of the solving thread, without threads that evaluate functions.
//
// Errors.  Exceptions of the program's functions are passed on.  NumericalError: functions that are not finite at
// the start.  ArgumentError for:
//
// - a start of wrong size, or options that only Ipopt has
// - a program without second derivatives (HessianKind::kLimitedMemory)
// - StructuredInteriorPoint: a program whose rows couple more than neighbouring stages (solve_with_riccati lifts
// these, lifted_nlp.h)
//
// Source: A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search algorithm for
// large-scale nonlinear programming", Mathematical Programming 106(1), 2006: its names and constants.
#pragma once

#include <Eigen/Core>
#include <memory>

#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

NlpSolution solve_with_riccati(Nlp& problem, const std::vector<double>& start,
                               const SolverOptions& options = {});

// The method for repeated solves of one program, in the program's units.  A solve starts from any point; with
// `warm`, also from the multipliers and barrier parameter of an earlier solution.  Bounds may change between solves.
// If two bounds become equal, or a row gets its first bound, the structure is built again.
class StructuredInteriorPoint {
 public:
  explicit StructuredInteriorPoint(Nlp& nlp);
  ~StructuredInteriorPoint();

  NlpSolution solve(const std::vector<double>& start, const SolverOptions& options,
                    const NlpSolution* warm = nullptr);

  // The derivatives of the first stage's variables with respect to those of them that equal bounds fix (`held`):
  // (variables of the first stage x held), to first order at the last solution.  Uses the program's kind of Hessian
  // and the final barrier, so variables at a limit stay there.  Empty if the last solve ended at no minimum of its
  // quadratic model.
  Eigen::MatrixXd derivatives(const std::vector<std::size_t>& held);

 private:
  class Method;
  Nlp& nlp_;
  std::unique_ptr<Method> method_;
};

}  // namespace dyntape
