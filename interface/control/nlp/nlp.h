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
// A program may say how large its numbers typically are.  The solver divides by that (scaled_nlp.h), so that its
// tolerances, and with them the optimum and the verdict, are the same in metres and in millimetres.  A program
// that says nothing should be written in units in which its numbers are near one.
//
// An evaluation returns false where a value is not finite or not defined: the solver shortens its step.  It
// does not throw for that reason; it may throw for any other, and the solver passes the exception on.
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

enum class HessianKind {
  kExact,          // of the Lagrangian
  kGaussNewton,    // 2 Jr^T Jr of the least-squares costs; curvature of dynamics and constraints is dropped
  kLimitedMemory,  // none, an empty pattern: the solver approximates it
};

struct NlpShape {
  std::vector<double> x_lower, x_upper;  // (n)
  std::vector<double> g_lower, g_upper;  // (m)
  Pattern jacobian;                      // (m x n)
  Pattern hessian;                       // (n x n), lower triangle
  HessianKind hessian_kind = HessianKind::kExact;
  // Where the stages of a chain begin among the variables; empty: there is one.  Rows tie neighbours, inequalities and entries
  // of the Hessian one stage.  An equality may tie stages farther apart if it is linear in all but its last one, with derivatives
  // that never change (lifted_nlp.h).
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

  // Typical sizes of the numbers, positive, judged at a point: the start of a solve, or a solution that was found
  // in units `before`, in which what is tiny is as good as zero and keeps its unit.
  virtual NlpScaling scaling(const std::vector<double>& at, const NlpScaling& before = {}) {
    static_cast<void>(at), static_cast<void>(before);
    return {};
  }

  // Throws NumericalError, saying where, unless values and first derivatives are finite at x; of a program that cannot
  // tell, nothing.
  virtual void check_finite(const std::vector<double>& x) { static_cast<void>(x); }

  // For messages: what variable i and constraint j are.
  virtual std::string variable_name(std::size_t i) const { return "x[" + std::to_string(i) + "]"; }
  virtual std::string constraint_name(std::size_t j) const { return "g[" + std::to_string(j) + "]"; }
};

}  // namespace dyntape
