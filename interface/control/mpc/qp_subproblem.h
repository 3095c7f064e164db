// SPDX-License-Identifier: BSD-3-Clause
//
// The quadratic model of a program at a point: its cost to second order, its rows to first.
//
//   QpSubproblem model(nlp);
//   if (model.expand(x, lambda)) s = StructuredInteriorPoint(model).solve(...)        // one SQP step
//
//   f + grad f.(x - x_0) + 1/2 (x - x_0).H (x - x_0),    g + J (x - x_0),    H that of f + lambda.g at x_0
//
// Variables, bounds and patterns are those of the program.
#pragma once

#include <dyntape/interface/control/nlp/nlp.h>

namespace dyntape {

class QpSubproblem : public Nlp {
 public:
  explicit QpSubproblem(Nlp& nlp);

  // Returns false if the program has no finite values or derivatives at x (n), with lambda (m).
  bool expand(const std::vector<double>& x, const std::vector<double>& lambda);
  const std::vector<double>& x() const { return x_; }  // the point, and the program's values there
  const std::vector<double>& g() const { return g_; }
  const std::vector<double>& gradient() const { return gradient_; }
  const std::vector<double>& jacobian() const { return jacobian_; }
  const std::vector<double>& hessian() const { return hessian_; }
  // Call it after the program's bounds have changed.
  void take_bounds();

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override;
  bool gradient(const double* x, double* gradient) override;
  bool constraints(const double* x, double* g) override;
  bool jacobian(const double* x, double* nonzeros) override;
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override;
  std::string variable_name(std::size_t i) const override { return nlp_.variable_name(i); }
  std::string constraint_name(std::size_t j) const override { return nlp_.constraint_name(j); }

 private:
  void curve(const double* x);  // H (x - x_0), into curved_

  Nlp& nlp_;
  NlpShape shape_;
  double f_ = 0;
  std::vector<double> x_, g_, gradient_, jacobian_, hessian_, curved_;
};

}  // namespace dyntape
