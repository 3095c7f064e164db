// SPDX-License-Identifier: BSD-3-Clause
//
// A nonlinear program, as solvers see it.
//
//   minimise f(x)   subject to   g_lower <= g(x) <= g_upper,   x_lower <= x <= x_upper
//
//   class Rosenbrock : public Nlp { ... };          // answers the six questions below
//   NlpSolution s = solve_with_ipopt(problem, start, {.tolerance = 1e-10});      // ipopt.h
//
// Shapes: x (n), g (m), the Jacobian of g as the non-zeros of a fixed pattern (m x n), the Hessian of
//   sigma f(x) + lambda . g(x)
// as the non-zeros of the lower triangle of a fixed pattern (n x n), each place once.  An infinite bound is
// absent; equal bounds make an equality or a fixed variable.
//
// An evaluation returns false where a value is not finite or not defined: the solver shortens its step.  It
// does not throw for that reason; it may throw for any other, and the solver passes the exception on.
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/pattern.h>

namespace dyntape {

struct NlpShape {
  std::vector<double> x_lower, x_upper;  // (n)
  std::vector<double> g_lower, g_upper;  // (m)
  Pattern jacobian;                      // (m x n)
  Pattern hessian;                       // (n x n), lower triangle

  std::size_t n() const { return x_lower.size(); }
  std::size_t m() const { return g_lower.size(); }
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

  // For messages: what variable i and constraint j are.
  virtual std::string variable_name(std::size_t i) const { return "x[" + std::to_string(i) + "]"; }
  virtual std::string constraint_name(std::size_t j) const { return "g[" + std::to_string(j) + "]"; }
};

}  // namespace dyntape
