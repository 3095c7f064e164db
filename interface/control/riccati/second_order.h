// SPDX-License-Identifier: BSD-3-Clause
//
// Is a stationary point a minimum?  The second-order condition, and the way down where it fails.
//
//   const CurvatureCheck check = check_second_order(nlp, solution);
//   if (check.order == StationaryPoint::kNotMinimum) ...        // the objective falls along +- check.direction
//
// At a minimum d . W d >= 0 for every d with J d = 0 that leaves active bounds where they are; W is the Hessian of the
// Lagrangian.  Bounds enter as in an interior-point method, by W + Sigma with Sigma = multiplier / distance, which is large
// where a bound is active and zero where it is not.  The factorisation of the stages (stage_kkt.h) says whether the
// reduced Hessian is positive definite; inverse iteration with the smallest shift that makes it so finds the direction of
// most negative curvature, and the point is called no minimum only if the curvature along it, computed from W and J
// themselves, is negative beyond rounding.
//
// Where the curvature along a direction is zero, the second order does not tell: -u^4 and u^3 are stationary at 0.  `flat` holds such
// directions, one for each kind of variable of a stage at most, and falls_along() looks along them: if the Lagrangian falls, by the third
// order or higher, the point is no minimum.
//
// Where the program's Hessian is an approximation, that of differences of first derivatives is judged.  A program whose
// stages are too large for dense factors is not: kUnknown.  Take a scaled program (scaled_nlp.h), so that directions are relative to nominal values.
//
// J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd edition, theorem 12.5 and section 16.2 (inertia).
#pragma once

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

struct CurvatureCheck {
  StationaryPoint order = StationaryPoint::kUnknown;
  std::vector<double> direction;  // (n) of negative curvature, its largest entry 1; empty: none
  std::vector<std::vector<double>> flat =
      {};  // (n) each: directions of curvature zero, where the order is kMinimum
};

CurvatureCheck check_second_order(Nlp& problem, const NlpSolution& at);

// The sum of those among these directions, or of their negatives, along which the Lagrangian falls by the third order or higher;
// empty: it falls along none.
std::vector<double> falls_along(Nlp& problem, const NlpSolution& at,
                                const std::vector<std::vector<double>>& flat);

// The same of the violation, 1/2 |c|^2 with c what the rows lack, at a point where it is stationary and not zero: kNotMinimum
// where the violation falls to the second order, as that of |u|^2 = 1 does from u = 0.
CurvatureCheck check_violation(Nlp& problem, const std::vector<double>& x);

}  // namespace dyntape
