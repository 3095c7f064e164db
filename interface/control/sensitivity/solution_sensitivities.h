// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of the solution of a nonlinear program with respect to its data, by the implicit function theorem.
//
//   SolutionSensitivities derivatives(nlp, solution);  // a converged solve with exact second derivatives
//   if (!derivatives.good()) std::cerr << derivatives.why() << "\n";
//   const SolutionStep s = derivatives.along(x_held, g_held);  // derivatives s.x, s.lambda, s.cost
//
// At a solution the held variables are those with equal bounds, and those at a bound.  The held rows are equalities,
// and inequalities at a bound.  All others are free, with zero bound multipliers.  To first order, with L = f +
// lambda.g,
//
//   [ W  J^T ] [ dx      ]   [ a ]        free variables, held rows; W = d2L/dx2
//   [ J   0  ] [ dlambda ] = [ b ]
//
// The system is solved by stages (stage_kkt.h), in time linear in their number: one factorisation, then one solve
// per direction.
//   along(d, e)   held variables move by d, bounds of held rows by e:  a = -W d,  b = e - J d.  A parameter is a held
//                 variable.  The cost changes by (grad L).d - lambda.e, the envelope theorem
//   solve(a, b)   any right side; for programs whose functions change, a = -d(grad L), b = -dg
// The system is symmetric, so solve() is also its transpose, which gives products with Jacobians
// (quadratic_layer.h).
//
// `from`, `to`: the range of multiples of the step in which the active set is constant, to first order; zero if
// unknown.
//
// If a variable is at a bound together with all others of an equality, the equality determines it.  Example: a free
// duration is a variable of every point; at its bound one of them is held.
//
// Active bounds are determined by the larger of bound multiplier and distance, in the units of the solve
// (solution.units), and checked with a Newton step with these bounds.  status() says if derivatives are not valid:
//   kWeaklyActive    a bound has neither a multiplier nor a distance (the Newton step takes more than half of both),
//                    or the step is long because many bounds of a fine mesh are about to become active.  There are
//                    one-sided derivatives; the returned ones are in between: those of the interior-point method's
//                    own solution, all bounds weighted by multiplier over distance.  If no bound is really weak,
//                    solve to a smaller tolerance
//   kDependentRows   held rows are dependent: multipliers are not unique, derivatives may not exist
//   kNoStrictMinimum no strict minimum in the free directions (second-order condition): derivatives are NaN
//   kNotASolution    the first-order conditions do not hold: derivatives are NaN
//   kNotFinite       the program has no finite derivatives there: derivatives are NaN
//
// The program may be destroyed before this object.
//
// Errors.  ArgumentError: a Hessian that is not exact, a solution or vectors of wrong size, stages that stage_kkt.h
// refuses.
//
// Sources: A. V. Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear Programming, 1983, theorem
// 3.2.2; J. Nocedal, S. J. Wright, Numerical Optimization, 2nd edition, 12.8.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include <dyntape/interface/control/nlp/sensitivity_status.h>
#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

struct SolutionStep {
  Eigen::VectorXd x, lambda;         // (n), (m)
  Eigen::VectorXd bound_multiplier;  // (n) of upper_multiplier - lower_multiplier
  double cost = 0;                   // from along(); solve() does not set it
  double from = 0, to = 0;           // from <= 0 <= to
};

class SolutionSensitivities {
 public:
  SolutionSensitivities(Nlp& nlp, const NlpSolution& solution);
  ~SolutionSensitivities();
  SolutionSensitivities(SolutionSensitivities&&) noexcept;
  SolutionSensitivities& operator=(SolutionSensitivities&&) noexcept;

  SensitivityStatus status() const;
  bool good() const { return status() == SensitivityStatus::kGood; }
  const std::string& why() const;  // the reason if not good, or ""
  // Weakly active ones; and held ones, without equalities and equal bounds.
  const std::vector<std::size_t>&weak_variables() const, &weak_rows() const;
  const std::vector<std::size_t>&held_variables() const, &held_rows() const;

  // d (n): entries of free variables are ignored.  e (m): for rows that are not held, the change of the bounds that
  // limits `from` and `to`.
  SolutionStep along(const Eigen::VectorXd& d, const Eigen::VectorXd& e);
  // a (n): for held variables added to their bound multipliers.  b (m): like e.
  SolutionStep solve(const Eigen::VectorXd& a, const Eigen::VectorXd& b);
  // The Newton step from the given solution, which the barrier keeps away from bounds, to the limit.  Add it to x,
  // lambda and bound multipliers.
  const SolutionStep& correction() const;

 private:
  class Held;
  std::unique_ptr<Held> held_;
};

}  // namespace dyntape
