// SPDX-License-Identifier: BSD-3-Clause
//
// An interior-point method of our own for programs whose variables stand in a chain of stages (NlpShape::stages): its linear
// systems take time linear in the number of stages (riccati_kkt.h), and it keeps no static state, so any number of solves run
// at once.
//
//   NlpSolution s = solve_with_riccati(problem, start, {.tolerance = 1e-10});
//   if (s.status == SolveStatus::kSolved) use(s.x, s.objective);
//
// The same programs, units, rounds, tolerances and verdicts as with Ipopt (ipopt.h); what differs is how steps are found.
//
// Method.  Slacks and logarithmic barriers, primal and dual Newton steps, a filter line search with second-order corrections;
// a barrier parameter that falls when its problem is solved to a part of it, and first rises, tenfold and twice at most, where
// bounds cut three steps in a row to less than a tenth: an arm within its limits took 52 iterations, now 38.  Where the
// reduced Hessian is not positive definite the Hessian is shifted until it is.  Where no step helps, the squares of what the
// constraints lack are minimised until the filter takes the point (restoration); where these have a minimum that is not
// zero, the program is locally infeasible.
//
// max_seconds is processor time of the thread that solves, not of those that evaluate for it.
//
// Errors.  ArgumentError: a start of the wrong size, options of Ipopt's own, a program without second derivatives
// (HessianKind::kLimitedMemory), or one whose rows tie more than neighbours (of
// StructuredInteriorPoint; solve_with_riccati knows those of lifted_nlp.h).  NumericalError: the functions are not finite at
// the start.  What the problem's functions throw comes through.
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

// The method itself, for one program solved again and again: in its units as they are, from any start, or, with `warm`, going on
// from an earlier solution's multipliers and barrier as well.  Bounds of the program may change between solves; where two
// become equal, or a row has its first, all is laid out anew.
class StructuredInteriorPoint {
 public:
  explicit StructuredInteriorPoint(Nlp& nlp);
  ~StructuredInteriorPoint();

  NlpSolution solve(const std::vector<double>& start, const SolverOptions& options,
                    const NlpSolution* warm = nullptr);

  // (variables of the first stage x held) how these of the last solution change, to first order, with those of them that are held
  // by equal bounds.  With the program's own kind of Hessian and the barrier as it ended, so what is at a limit
  // stays there.  Empty where the last solve ended at no minimum of its quadratic model.
  Eigen::MatrixXd derivatives(const std::vector<std::size_t>& held);

 private:
  class Method;
  Nlp& nlp_;
  std::unique_ptr<Method> method_;
};

}  // namespace dyntape
