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
// Solved from stage to stage, of which there is one (interior_point.h), then by one Newton step with the constraints
// that hold at equality held: multipliers and x are exact to rounding.  Slopes are those of that system
// (solution_sensitivities.h); with [u; w] = K^-1 [slope; 0],
//   dl/dq = -u,   dl/dQ = -(u x^T + x u^T) / 2,   dl/db = w_A,   dl/dA = -(nu u^T + w_A x^T),   dl/dh, dl/dG likewise
// which is what OptNet's system gives at exact complementarity.  Of Q the symmetric part is told: Q changes as a
// symmetric matrix.
//
// status() says where these are not derivatives: a constraint that rests with no multiplier (either side has derivatives of its own, and
// these lie between), constraints that depend on each other, x not unique, no solution; of the latter two all derivatives are NaN.
//
// Where the solve found no solution, outcome() says why, and certificate() proves it:
//   kInfeasible  multipliers nu, lambda >= 0 with A^T nu + G^T lambda = 0 and b.nu + h.lambda = -1: so weighed, the constraints add
//                up to 0 <= -1 (Farkas' lemma)
//   kUnbounded   a direction x with Q x = 0, A x = 0, G x <= 0 and q.x = -1: along it the cost falls without end
//   kUnknown     neither was found to rounding: nearly one of them, or nearly neither
// Each is the projection of a vector on a cone, which is found to rounding.
//
// Meant for 1 to some 100 variables; Q may be singular where the constraints make up for it.  An entry of h may be
// infinite.
//
// Errors: ArgumentError for sizes that do not fit, numbers that are none, Q that is not symmetric or not positive
// semidefinite.
//
// Sources: S. Boyd, L. Vandenberghe, Convex Optimization, 5.8 (alternatives); B. Amos, J. Z. Kolter, OptNet: Differentiable optimization as a layer in neural networks, ICML 2017.
#pragma once

#include <optional>

#include <dyntape/interface/control/sensitivity/solution_sensitivities.h>

namespace dyntape {

struct QuadraticProgram {
  Eigen::MatrixXd Q = {};  // (n x n) symmetric
  Eigen::VectorXd q = {};  // (n)
  Eigen::MatrixXd A = {};  // (equalities x n)
  Eigen::VectorXd b = {};
  Eigen::MatrixXd G = {};  // (inequalities x n)
  Eigen::VectorXd h = {};
};

struct QuadraticSolution {
  Eigen::VectorXd x, nu,
      lambda;  // (n), multipliers of the equalities and of the inequalities: Q x + q + A^T nu + G^T lambda = 0
  // Of forward(): how many of such changes leave the active constraints what they are, to first order.
  double from = 0, to = 0;
};

enum class QpStatus { kSolved, kInfeasible, kUnbounded, kUnknown };

class QuadraticLayer {
 public:
  explicit QuadraticLayer(const QuadraticProgram& program, double tolerance = 1e-10);

  const QuadraticSolution& solution() const { return solution_; }
  SolveStatus solve_status() const { return solve_status_; }
  SensitivityStatus status() const { return slopes_->status(); }
  bool good() const { return slopes_->good(); }
  const std::string& why() const { return why_.empty() ? slopes_->why() : why_; }
  QpStatus outcome() const { return outcome_; }
  const QuadraticSolution& certificate() const {
    return certificate_;
  }                                       // its parts that are not of the proof are empty
  std::vector<std::size_t> weak() const;  // inequalities that rest with no multiplier

  QuadraticSolution forward(const QuadraticProgram& change);
  QuadraticProgram backward(const Eigen::VectorXd& slope);

 private:
  QuadraticSolution split(const SolutionStep& step) const;
  void certify();

  QuadraticProgram program_;
  QuadraticSolution solution_, certificate_;
  QpStatus outcome_ = QpStatus::kSolved;
  std::string why_;
  SolveStatus solve_status_;
  std::optional<SolutionSensitivities> slopes_;
};

}  // namespace dyntape
