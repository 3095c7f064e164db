// SPDX-License-Identifier: BSD-3-Clause
//
// Newton's method for R(z; p) = 0 with a compiled residual and its exact Jacobian.
//
//   Newton newton(CompiledFunction::make(residual, {.order = Order::kFirst}));
//   if (!newton.solve(p, size)) ... newton.trouble()
//   newton.z()                                           // the solution; set it to the initial guess before
//
// A step z + a d is accepted if the next one with the same Jacobian is shorter, |d'| <= (1 - a/4) |d|; else a is
// halved.  This test does not depend on the units of R.  While steps shrink tenfold the Jacobian is reused, so a
// smooth problem takes one Jacobian and two or three values.  Converged if the step is below the rounding of `size`,
// the size of the numbers to which z is added, or is rounding itself.  No allocation.
//
// Source: P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, 3.3 (error-oriented descent).
#pragma once

#include <string>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/codegen/compiled_function.h>

namespace dyntape {

class Newton {
 public:
  enum class Outcome { kSolved, kGuard, kNotFinite, kSingular, kNoDescent, kTooLong };

  explicit Newton(const CompiledFunction& residual);

  Eigen::VectorXd& z() { return z_; }

  Outcome solve(const double* p, double size);

  int residuals() const { return residuals_; }     // evaluations in the last solve
  double last_step() const { return last_step_; }  // largest entry of the last step
  const CompiledFunction& residual() const { return residual_; }
  const Violation& violation() const { return violation_; }

 private:
  Outcome evaluate(Order order, const Eigen::VectorXd& z, const double* p);
  Outcome linearise(const double* p);  // at z_: lu_ and the step d_
  void solve_linear(Eigen::VectorXd& d);

  CompiledFunction residual_;
  CompiledFunction::Workspace workspace_;
  Eigen::VectorXd z_, trial_, r_, d_, d_next_, non_zeros_;
  Eigen::MatrixXd jacobian_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  Violation violation_;
  int residuals_ = 0;
  double last_step_ = 0;
};

}  // namespace dyntape
