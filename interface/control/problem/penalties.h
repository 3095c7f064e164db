// SPDX-License-Identifier: BSD-3-Clause
//
// Penalties: turn a constraint or a residual into a soft term of the cost.
//
//   p.add(soft(path_inequality("slow", v, lower, upper), RelaxedBarrier{.mu = 1e-3, .delta = 1e-2}));
//   p.add(soft(path_equality("power", joint_power(scene, unit)), SmoothAbsolute{.weight = 1, .width = 0.1}));
//   p.add(soft(keep_clear(scene, hand, post), Quadratic{100}));
//   p.add(soft(running_squares("marker", away), Huber{.weight = 1, .width = 0.02}));
//
// The penalty acts where the term acts and keeps its name.  For equalities and squared residuals, r is the residual.
// For inequalities, r is the distance of each entry beyond its bounds, and zero between them.  Entries are summed.
//
//                      penalty of r                               near 0           far away
//   Quadratic          weight r^2
//   Huber              2 weight d^2 (sqrt(1 + (r/d)^2) - 1)       weight r^2       2 weight d |r|      d: width
//   SmoothAbsolute     weight (sqrt(r^2 + e^2) - e)               weight r^2/(2e)  weight |r|          e: width
//
// Huber and SmoothAbsolute are the same function, with either the curvature at zero or the slope far away as
// parameter.  The function is the smooth form of Huber's.  The piecewise form has no curvature on its lines, and its
// curvature jumps; there Newton steps oscillate.  Quadratic and Huber are squares of a residual that is smooth in
// r, so Gauss-Newton applies.  For inequalities the slope is continuous at a bound, the curvature is not.
//
//   RelaxedBarrier     with h the distance inside each finite bound: -mu log h if h > delta; below, the parabola with
//                      the same value, slope and curvature: mu/2 (((h - 2 delta)/delta)^2 - 1) - mu log delta.
//
// The barrier pushes away from bounds before they are reached, decreases without limit as h grows, and is defined
// beyond bounds, so that any start is valid.  If mu and delta go to zero, the optimum converges to the optimum with
// the bound.  The barrier is not a sum of squares; Gauss-Newton uses its exact curvature in h (Term::curvature).
//
// Range: |r| up to 1e150 widths.
//
// Errors.  ArgumentError: a plain cost, a barrier on a term that is not an inequality, a weight, width, mu or delta
// that is not positive.
//
// Sources: J. Hauser, A. Saccon, A barrier function method for the optimization of trajectory functionals with
// constraints, CDC 2006; C. Feller, C. Ebenbauer, Relaxed logarithmic barrier function based model predictive
// control of linear systems, IEEE Transactions on Automatic Control 62(3), 2017.
#pragma once

#include <variant>

#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct Quadratic {
  double weight = 1;
};
struct Huber {
  double weight = 1, width = 1;  // width in the unit of r
};
struct SmoothAbsolute {
  double weight = 1, width = 1e-2;  // likewise
};
struct RelaxedBarrier {
  double mu = 1e-2, delta = 1e-3;  // delta in the unit of the bound
};
using Penalty = std::variant<Quadratic, Huber, SmoothAbsolute, RelaxedBarrier>;

Term soft(const Term& term, const Penalty& penalty);

}  // namespace dyntape
