// SPDX-License-Identifier: BSD-3-Clause
//
// How the solution of a nonlinear program moves when what it is given does: derivatives by the implicit function theorem.
//
//   SolutionSensitivities derivatives(nlp, solution);                       // of a solve to its end; exact second derivatives
//   if (!derivatives.good()) std::cerr << derivatives.why() << "\n";
//   const SolutionStep s = derivatives.along(x_held, g_held);        // s.x, s.lambda, s.bound_multiplier, s.cost: what changes with 1
//
// At a solution some variables are held: those with equal bounds, and those that rest on a bound.  So are some rows:
// equalities, and inequalities that rest on a bound.  All the others are free, their bounds without a bound multiplier.  To
// first order, with L = f + lambda.g,
//
//   [ W  J^T ] [ dx      ]   [ a ]        free variables, held rows; W = d2L/dx2
//   [ J   0  ] [ dlambda ] = [ b ]
//
// which is solved by stages (stage_kkt.h), in time linear in their number: one factorisation, then a solve a direction.
//   along(d, e)   variables that are held move by d, held rows' bounds by e:  a = -W d,  b = e - J d.  A parameter is
//                 a variable that is held.  The cost changes by (grad L).d - lambda.e, the envelope theorem
//   solve(a, b)   any right side: of programs whose functions change, a = -d(grad L), b = -dg
// The system is symmetric: solve() is its transpose, too, which gives products with Jacobians (quadratic_layer.h).
//
// `from`, `to`: how many of such steps leave what is held held and what is free free, to first order; zero where that
// is not known.
//
// A variable that rests on a bound together with all others of an equality is left to that equality: a free duration is a
// variable of every point, of which one is held where it rests on its bound.
//
// What is held is judged by bound multiplier and distance, in the units of the solve (solution.units), whichever is greater; and
// held against a Newton step with the bounds so.  Where derivatives are not what they seem, status() says so:
//   kWeaklyActive    a bound with neither a bound multiplier nor a distance: that step takes more than half of what there was; or
//                    the step goes far, because on a fine mesh many are about to be held.  Either side has derivatives of its
//                    own then, and what is given lies between: the derivatives of the interior-point method's own solution,
//                    all bounds by bound multiplier over distance.  Where no bound is really weak, a solve to a smaller tolerance
//                    tells them apart
//   kDependentRows   the rows that are held depend on each other: bound multipliers are not unique, derivatives may not exist
//   kNoStrictMinimum no strict minimum on what the rows leave free (second-order condition): derivatives are NaN
//   kNotASolution    the first-order conditions do not hold: derivatives are NaN
//   kNotFinite       the program has no finite derivatives there: derivatives are NaN
//
// The program need not outlive the object.  Errors: ArgumentError for a Hessian that is not exact, for a solution or
// vectors of other sizes, and where the stages refuse (stage_kkt.h).
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
  double cost = 0;                   // of along(); solve() does not know it
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
  const std::string& why() const;  // a sentence; "": good
  // Weakly active ones, and those that are held, equalities and equal bounds not counted.
  const std::vector<std::size_t>&weak_variables() const, &weak_rows() const;
  const std::vector<std::size_t>&held_variables() const, &held_rows() const;

  // d (n): entries of free variables are not read.  e (m): of rows that are not held it moves the bounds that they
  // keep away from.
  SolutionStep along(const Eigen::VectorXd& d, const Eigen::VectorXd& e);
  // a (n): of held variables, what is added to their bound multipliers.  b (m): as e.
  SolutionStep solve(const Eigen::VectorXd& a, const Eigen::VectorXd& b);
  // The Newton step from the solution that was given, which a barrier keeps off the bounds, to what it approaches:
  // add it to x, lambda and bound multipliers.
  const SolutionStep& correction() const;

 private:
  class Held;
  std::unique_ptr<Held> held_;
};

}  // namespace dyntape
