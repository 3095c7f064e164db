// SPDX-License-Identifier: BSD-3-Clause
//
// A nonlinear program scaled by nominal values, so that its numbers are near one in any units.
//
//   ScaledNlp scaled(problem, problem.scaling(start));
//   NlpSolution s = scaled.in_own_units(solve(scaled, scaled.in_scaled_units(start)));
//
// Variables, constraints and objective are divided by their nominal values, rounded to powers of two, so no digit
// changes.  With y = x / s, h = g / r, F = f / c:
//   dF/dy = (s / c) df/dx,   dh/dy = (s / r) dg/dx,   lambda_g = (c / r) lambda_h,   price_x = (c / s) price_y
#pragma once

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

class ScaledNlp : public Nlp {
 public:
  // Empty nominal values mean ones.  ArgumentError for a wrong size, or values that are not positive and finite.
  ScaledNlp(Nlp& nlp, NlpScaling scaling);

  // Call it after the program's bounds have changed.
  void take_bounds();

  std::vector<double> in_scaled_units(const std::vector<double>& x) const;
  NlpSolution in_scaled_units(NlpSolution solution) const;
  NlpSolution in_own_units(NlpSolution solution) const;

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override;
  bool gradient(const double* x, double* gradient) override;
  bool constraints(const double* x, double* g) override;
  bool jacobian(const double* x, double* nonzeros) override;
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override;
  std::string variable_name(std::size_t i) const override { return nlp_.variable_name(i); }
  std::string constraint_name(std::size_t j) const override { return nlp_.constraint_name(j); }

  const NlpScaling& units() const { return scale_; }

 private:
  const double* own(const double* x);

  Nlp& nlp_;
  NlpScaling scale_;
  NlpShape shape_;
  std::vector<double> of_gradient_, of_jacobian_, of_hessian_;  // factors of the non-zeros
  std::vector<double> x_, lambda_;                              // in the program's units
};

}  // namespace dyntape
