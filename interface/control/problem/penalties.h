// SPDX-License-Identifier: BSD-3-Clause
//
// Soft terms: what a constraint or a residual lacks as a cost.
//
//   p.add(soft(path_inequality("slow", v, lower, upper), RelaxedBarrier{.mu = 1e-3, .delta = 1e-2}));
//   p.add(soft(path_equality("power", joint_power(scene, unit)), SmoothAbsolute{.weight = 1, .width = 0.1}));
//   p.add(soft(keep_clear(scene, hand, post), Quadratic{100}));
//   p.add(soft(running_squares("marker", away), Huber{.weight = 1, .width = 0.02}));
//
// Acts where the term acts and keeps its name.  Of an equality, or of residuals that are squared, it takes the residual r;
// of an inequality what each entry lies beyond its bounds, which is zero between them; entries add up.
//
//                      of r                                       near 0           far away
//   Quadratic          weight r^2
//   Huber              2 weight d^2 (sqrt(1 + (r/d)^2) - 1)       weight r^2       2 weight d |r|      d: width
//   SmoothAbsolute     weight (sqrt(r^2 + e^2) - e)               weight r^2/(2e)  weight |r|          e: width
//
// The last two are one function, said by its curvature at zero or by its slope far away.  It is the smooth form of Huber's: the
// one that is pieced together from a parabola and lines has no curvature at all on its lines, and a jump of it between, where
// Newton's steps go back and forth.  Quadratic and Huber are written as squares of a residual that is smooth in r, at zero
// too, so Gauss-Newton knows them.  Of an inequality the curvature jumps at a bound, the slope does not.
//
//   RelaxedBarrier     of the room h to each finite bound of an inequality: -mu log h where h > delta, below it the parabola with
//                      the same value, slope and curvature: mu/2 (((h - 2 delta)/delta)^2 - 1) - mu log delta.
//
// It pushes away from bounds before they are reached, falls without end as room grows, and is defined where a bound is broken,
// so that a start may be anywhere.  As mu and delta go to zero the optimum goes to that with the bound itself.  It is no sum of
// squares; Gauss-Newton gets its curvature in h exactly (Term::curvature).  Sources: J. Hauser, A. Saccon, A barrier function
// method for the optimization of trajectory functionals with constraints, CDC 2006; C. Feller, C. Ebenbauer, Relaxed logarithmic
// barrier function based model predictive control of linear systems, IEEE Transactions on Automatic Control 62(3), 2017.
//
// Numbers: |r| up to 1e150 widths.
//
// Errors: ArgumentError for a plain cost, for a barrier of what is no inequality, for a weight, width, mu or delta that is no
// positive number.
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
