// SPDX-License-Identifier: BSD-3-Clause
//
// The interface of a nonlinear program for solvers.  Implement it to solve your own program.
//
//   minimise f(x)   subject to   g_lower <= g(x) <= g_upper,   x_lower <= x <= x_upper
//
//   class Rosenbrock : public Nlp { ... };          // implements the six functions below
//   NlpSolution s = solve_with_ipopt(problem, start, {.tolerance = 1e-10});      // ipopt.h
//
// Shapes: x (n), g (m), the Jacobian of g as the non-zeros of a fixed pattern (m x n), the Hessian of
//   sigma f(x) + lambda . g(x)
// as the non-zeros of the lower triangle of a fixed pattern (n x n), each position once.  An infinite bound means no
// bound.  Equal bounds are an equality or a fixed variable.
//
// scaling() returns typical sizes of the numbers.  The solver divides by them (scaled_nlp.h), so that tolerances,
// optimum and verdict do not depend on units.  Without scaling(), use units in which the numbers are near one.
//
// An evaluation returns false if a value is not finite or undefined; the solver then shortens its step.  It must not
// throw for this reason.  Other exceptions are passed on by the solver.
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

enum class HessianKind {
  kExact,          // of the Lagrangian
  kGaussNewton,    // 2 Jr^T Jr of the squared costs; without the curvature of dynamics and constraints
  kLimitedMemory,  // none, with an empty pattern: the solver approximates it
};

struct NlpShape {
  std::vector<double> x_lower, x_upper;  // (n)
  std::vector<double> g_lower, g_upper;  // (m)
  Pattern jacobian;                      // (m x n)
  Pattern hessian;                       // (n x n), lower triangle
  HessianKind hessian_kind = HessianKind::kExact;
  // First variables of the stages of a chain; empty: one stage.  Rows may couple neighbouring stages, inequalities
  // and entries of the Hessian one stage.  An equality may couple more distant stages if it is linear, with constant
  // derivatives, in all of them except its last (lifted_nlp.h).
  std::vector<std::size_t> stages = {};

  std::size_t n() const { return x_lower.size(); }
  std::size_t m() const { return g_lower.size(); }
};

struct NlpScaling {
  double objective = 1;
  std::vector<double> x = {}, g = {};  // (n), (m); empty: ones
};

class Nlp {
 public:
  virtual ~Nlp() = default;

  virtual const NlpShape& shape() const = 0;

  virtual bool objective(const double* x, double& value) = 0;
  virtual bool gradient(const double* x, double* gradient) = 0;  // (n)
  virtual bool constraints(const double* x, double* g) = 0;      // (m)
  virtual bool jacobian(const double* x, double* nonzeros) = 0;  // (jacobian.nnz())
  virtual bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) = 0;

  // Typical sizes of the numbers, positive, estimated at a point: the start of a solve, or a solution in units
  // `before`; values that are tiny in these units keep their unit.
  virtual NlpScaling scaling(const std::vector<double>& at, const NlpScaling& before = {}) {
    static_cast<void>(at), static_cast<void>(before);
    return {};
  }

  // Throws NumericalError, with the position, unless values and first derivatives are finite at x.  Default: no
  // check.
  virtual void check_finite(const std::vector<double>& x) { static_cast<void>(x); }

  // Names of variable i and constraint j for messages.
  virtual std::string variable_name(std::size_t i) const { return "x[" + std::to_string(i) + "]"; }
  virtual std::string constraint_name(std::size_t j) const { return "g[" + std::to_string(j) + "]"; }
};

}  // namespace dyntape
