// SPDX-License-Identifier: BSD-3-Clause
//
// Checks the second-order condition of a stationary point, and finds a descent direction if it fails.
//
//   const CurvatureCheck check = check_second_order(nlp, solution);
//   if (check.order == StationaryPoint::kNotMinimum) ...        // the objective decreases along +- check.direction
//
// Condition: at a minimum d . W d >= 0 for every d with J d = 0 that keeps active bounds active; W is the Hessian of
// the Lagrangian.  Bounds enter as in an interior-point method, by W + Sigma with Sigma = multiplier / distance,
// which is large for active bounds and zero for others.
//
// Method.  The factorisation of the stages (stage_kkt.h) tests whether the reduced Hessian is positive definite.  If
// not, inverse iteration with the smallest sufficient shift finds the direction of most negative curvature.  The
// point is not a minimum only if the curvature along this direction, computed from W and J, is negative beyond
// rounding.
//
// If the curvature along a direction is zero, higher orders decide: -u^4 and u^3 are stationary at 0.  `flat` has
// such directions, at most one for each kind of variable of a stage.  If falls_along() finds that the Lagrangian
// decreases along one of them by the third or a higher order, the point is not a minimum.
//
// If the program's Hessian is an approximation, finite differences of first derivatives are used instead.  If the
// stages are too large for dense factors, the result is kUnknown.  Pass a scaled program (scaled_nlp.h), so that
// directions are relative to nominal values.
//
// Source: J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd edition, theorem 12.5 and section 16.2
// (inertia).
#pragma once

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

struct CurvatureCheck {
  StationaryPoint order = StationaryPoint::kUnknown;
  std::vector<double> direction;  // (n) of negative curvature, largest entry 1; empty: none
  std::vector<std::vector<double>> flat =
      {};  // (n) each: directions of zero curvature, if the order is kMinimum
};

CurvatureCheck check_second_order(Nlp& problem, const NlpSolution& at);

// The sum of those of the directions, or of their negatives, along which the Lagrangian decreases by the third or a
// higher order; empty if there are none.
std::vector<double> falls_along(Nlp& problem, const NlpSolution& at,
                                const std::vector<std::vector<double>>& flat);

// The same for the violation 1/2 |c|^2 at a point where it is stationary and nonzero: kNotMinimum if it decreases to
// second order, like the violation of |u|^2 = 1 at u = 0.
CurvatureCheck check_violation(Nlp& problem, const std::vector<double>& x);

}  // namespace dyntape
