// SPDX-License-Identifier: BSD-3-Clause
//
// A dense quadratic program as a differentiable function of its data.  Use it as a layer in learning or tuning.
//
//   minimise  1/2 x.Q x + q.x   subject to  A x = b,  G x <= h
//
//   QuadraticLayer layer({.Q = Q, .q = q, .A = A, .b = b, .G = G, .h = h});     // A, b or G, h are optional
//   if (!layer.good()) std::cerr << layer.why() << "\n";
//   layer.solution().x
//   const QuadraticSolution d = layer.forward({.q = dq, .h = dh});       // d.x: derivative along the change of data
//   const QuadraticProgram g = layer.backward(slope);                    // slope dl/dx (n) -> g.Q = dl/dQ, ...
//
// Method.  The dual active-set method (nearest_point.h), with proximal steps along directions in which Q is
// singular.  Then one solve of the first-order conditions with fixed active rows makes x and the multipliers exact
// to rounding.  With K the matrix of these conditions and [u; w] = K^-1 [slope; 0],
//   dl/dq = -u,   dl/dQ = -(u x^T + x u^T) / 2,   dl/db = w_A,   dl/dA = -(nu u^T + w_A x^T),   dl/dh, dl/dG likewise
// This equals OptNet's system at exact complementarity.  Q is symmetric: of a change of Q the symmetric part is
// used.
//
// outcome() has a proof, in solution() or certificate(), that is exact to rounding:
//   kSolved      x, nu and lambda >= 0 satisfy the first-order conditions
//   kInfeasible  multipliers nu, lambda >= 0 with A^T nu + G^T lambda = 0 and b.nu + h.lambda = -1: the weighted sum
//                of the constraints is 0 <= -1 (Farkas' lemma)
//   kUnbounded   a direction x with Q x = 0, A x = 0, G x <= 0 and q.x = -1, along which the cost decreases without
//                limit; solution() has a feasible x
//   kUnknown     no proof to rounding: the data are within rounding of another outcome
//
// Derivatives exist only at a strict minimum.  status():
//   kGood             the solution is differentiable
//   kWeaklyActive     the rows weak() are active with multiplier zero; there are one-sided derivatives.
//                     forward(change) is exact along `change`, -forward(-change) is the other side; NaN if the step
//                     is not unique.  backward() treats weak rows as inactive, or as active if requested or if the
//                     minimum is not strict otherwise: the derivative for a slightly larger, or smaller, h of these
//                     rows
//   kDependentRows    active rows are dependent: multipliers are not unique.  forward() and backward() use an
//                     independent subset, rows with multipliers first
//   kNoStrictMinimum  x is not unique: derivatives are NaN
//   kNotASolution     outcome() is not kSolved: derivatives are NaN
//
// Size: 1 to about 100 variables.  Q may be singular.  An entry of h may be infinite.
//
// Errors.  ArgumentError: sizes that do not fit, numbers that are not finite, a Q that is not symmetric or not
// positive semidefinite.
//
// Sources: S. Boyd, L. Vandenberghe, Convex Optimization, 5.8 (alternatives); B. Amos, J. Z. Kolter, OptNet:
// Differentiable optimization as a layer in neural networks, ICML 2017; D. Bertsekas, P. Tseng, Partial proximal
// minimization algorithms for convex programming, 1994.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <string>
#include <vector>

#include <dyntape/interface/control/nlp/sensitivity_status.h>
#include <dyntape/interface/control/sensitivity/quadratic_program.h>

namespace dyntape {

enum class WeakRows { kOpen, kHeld };  // how backward() treats weakly active rows

class QuadraticLayer {
 public:
  explicit QuadraticLayer(const QuadraticProgram& program);

  const QuadraticSolution& solution() const { return solution_; }
  QpStatus outcome() const { return outcome_; }
  // Vectors that are not part of the proof are empty.
  const QuadraticSolution& certificate() const { return certificate_; }

  SensitivityStatus status() const { return status_; }
  bool good() const { return status_ == SensitivityStatus::kGood; }
  const std::string& why() const { return why_; }                 // the reason if not good, or ""
  const std::vector<std::size_t>& weak() const { return weak_; }  // active inequalities with multiplier zero

  QuadraticSolution forward(const QuadraticProgram& change) const;
  QuadraticProgram backward(const Eigen::VectorXd& slope, WeakRows weak = WeakRows::kOpen) const;

 private:
  using Rows = std::vector<Eigen::Index>;

  // The first-order conditions in scaled units, with the equalities and the inequalities `rows` as equations.
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

  QuadraticProgram program_, scaled_;  // scaled: Q has a unit diagonal, rows of A and G have unit norm
  Eigen::VectorXd roots_, of_A_, of_G_;
  QuadraticSolution solution_, certificate_;
  QpStatus outcome_ = QpStatus::kUnknown;
  SensitivityStatus status_ = SensitivityStatus::kGood;
  std::string why_;
  std::vector<std::size_t> weak_;
  Rows equal_, strong_, open_;  // active rows of A and G; weak rows
  Conditions held_, all_held_;  // without and with the weak rows
};

}  // namespace dyntape
