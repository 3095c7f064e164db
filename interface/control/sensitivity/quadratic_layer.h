// SPDX-License-Identifier: BSD-3-Clause
//
// A small dense quadratic program, and how its solution depends on all of its numbers: a layer of what is learned or
// tuned.
//
//   minimise  1/2 x.Q x + q.x   subject to  A x = b,  G x <= h
//
//   QuadraticLayer layer({.Q = Q, .q = q, .A = A, .b = b, .G = G, .h = h});     // A, b or G, h left out: none
//   if (!layer.good()) std::cerr << layer.why() << "\n";
//   layer.solution().x
//   const QuadraticSolution d = layer.forward({.q = dq, .h = dh});       // d.x: what changes with the data; left out: zero
//   const QuadraticProgram g = layer.backward(slope);                    // slope dl/dx (n) -> g.Q = dl/dQ, g.q = dl/dq, ...
//
// The dual active-set method solves it (nearest_point.h), with proximal steps along directions in which Q is singular; one solve of
// the first-order conditions with the active rows held makes x and multipliers exact to rounding.  With [u; w] = K^-1 [slope; 0],
// K the matrix of these conditions,
//   dl/dq = -u,   dl/dQ = -(u x^T + x u^T) / 2,   dl/db = w_A,   dl/dA = -(nu u^T + w_A x^T),   dl/dh, dl/dG likewise
// which is what OptNet's system gives at exact complementarity.  Q changes as a symmetric matrix: of a change of Q the symmetric part
// counts.
//
// outcome() comes with a proof, in solution() or certificate(), that is exact to rounding:
//   kSolved      x, nu and lambda >= 0 that fulfil the first-order conditions
//   kInfeasible  multipliers nu, lambda >= 0 with A^T nu + G^T lambda = 0 and b.nu + h.lambda = -1: so weighed, the constraints add
//                up to 0 <= -1 (Farkas' lemma)
//   kUnbounded   a direction x with Q x = 0, A x = 0, G x <= 0 and q.x = -1: along it the cost falls without end; and a feasible x
//                in solution()
//   kUnknown     no proof to rounding was found: the data lie within rounding of another outcome
//
// Derivatives exist only where the minimum is strict.  status() says what they are:
//   kGood             the solution is differentiable
//   kWeaklyActive     the rows weak() are active with multiplier zero.  The solution has a derivative to either side: forward(change)
//                     is exact along `change`, and -forward(-change) is that of the other side; it is NaN
//                     where the step to that side is not unique.  backward() takes weak rows as
//                     open, or, if asked to or if the minimum is not strict without them, as held: the derivative where h of these
//                     rows is a little larger, or a little smaller
//   kDependentRows    active rows depend on each other: multipliers are not unique.  Both take an independent part of the rows,
//                     those with multipliers first, and leave out the others
//   kNoStrictMinimum  x is not unique: derivatives are NaN
//   kNotASolution     outcome() is not kSolved: derivatives are NaN
//
// Meant for 1 to some 100 variables; Q may be singular.  An entry of h may be infinite.
//
// Errors: ArgumentError for sizes that do not fit, numbers that are not finite, Q that is not symmetric or not positive
// semidefinite.
//
// Sources: S. Boyd, L. Vandenberghe, Convex Optimization, 5.8 (alternatives); B. Amos, J. Z. Kolter, OptNet: Differentiable
// optimization as a layer in neural networks, ICML 2017; D. Bertsekas, P. Tseng, Partial proximal minimization algorithms for convex
// programming, 1994.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <string>
#include <vector>

#include <dyntape/interface/control/nlp/sensitivity_status.h>
#include <dyntape/interface/control/sensitivity/quadratic_program.h>

namespace dyntape {

enum class WeakRows { kOpen, kHeld };  // what backward() takes weakly active rows for

class QuadraticLayer {
 public:
  explicit QuadraticLayer(const QuadraticProgram& program);

  const QuadraticSolution& solution() const { return solution_; }
  QpStatus outcome() const { return outcome_; }
  // Parts that do not belong to the proof are empty.
  const QuadraticSolution& certificate() const { return certificate_; }

  SensitivityStatus status() const { return status_; }
  bool good() const { return status_ == SensitivityStatus::kGood; }
  const std::string& why() const { return why_; }                 // a sentence; "": good
  const std::vector<std::size_t>& weak() const { return weak_; }  // active inequalities with multiplier zero

  QuadraticSolution forward(const QuadraticProgram& change) const;
  QuadraticProgram backward(const Eigen::VectorXd& slope, WeakRows weak = WeakRows::kOpen) const;

 private:
  using Rows = std::vector<Eigen::Index>;

  // The first-order conditions in the units of the solve, with the equalities and inequalities `rows` held at equality.
  struct Conditions {
    Rows equal, kept;
    Eigen::MatrixXd K;
    Eigen::FullPivLU<Eigen::MatrixXd> factors;
  };
  Conditions conditions(const Rows& kept) const;
  QuadraticSolution solve(const Conditions& c, const QuadraticSolution& right) const;
  bool has_derivatives() const { return status_ < SensitivityStatus::kNoStrictMinimum; }
  QuadraticSolution one_sided(const QuadraticSolution& right) const;
  void measure(const QuadraticSolution& right, QuadraticSolution& step) const;
  QuadraticSolution none() const;
  QuadraticSolution unscaled(const QuadraticSolution& s) const;

  QuadraticProgram program_, scaled_;  // scaled: Q has a diagonal of ones, rows of A and G have length one
  Eigen::VectorXd roots_, of_A_, of_G_;
  QuadraticSolution solution_, certificate_;
  QpStatus outcome_ = QpStatus::kUnknown;
  SensitivityStatus status_ = SensitivityStatus::kGood;
  std::string why_;
  std::vector<std::size_t> weak_;
  Rows equal_, strong_, open_;  // rows of A and G that are held; weak rows
  Conditions held_, all_held_;  // without and with the weak rows
};

}  // namespace dyntape
