// SPDX-License-Identifier: BSD-3-Clause
//
// Excitation as a nonlinear program in the coefficients of the series, joint after joint.  Internal.
//
//   ExcitationProblem problem(arm, base, options);
//   problem.look_at(random_series(arm, options, 1));      // problem.value(), condition(), log_det()
//   solve_with_ipopt(problem, problem.flat(series));
#pragma once

#include <vector>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/control/nlp/nlp.h>
#include <dyntape/interface/identification/excitation.h>

namespace dyntape {

// The limits that an excitation keeps, one entry a joint, margin taken off.
struct ExcitationLimits {
  Eigen::VectorXd middle;  // of the range of positions (nv)
  Eigen::MatrixXd reach;   // (nv x 3): distance of position from `middle`, |velocity|, |acceleration|
};

ExcitationLimits excitation_limits(const dynamics::Model<double>& model, const ExcitationOptions& options);

// Keeps references to its arguments.
class ExcitationProblem : public Nlp {
 public:
  ExcitationProblem(const dynamics::Model<double>& model, const BaseParameters& base,
                    const ExcitationOptions& options);

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override;
  bool gradient(const double* x, double* gradient) override;
  bool constraints(const double* x, double* g) override;
  bool jacobian(const double* x, double* nonzeros) override;
  bool hessian(const double*, double, const double*, double*) override { return false; }  // L-BFGS asks none

  // Of the point looked at last; look_at is false where not all base parameters are excited.
  bool look_at(const FourierSeries& series) { return update(flat(series).data()); }
  double value() const { return value_; }
  double log_det() const { return log_det_; }
  double condition() const { return condition_; }

  // At each gradient: condition, mean semi-axis of the confidence ellipsoid.
  const std::vector<double>& conditions() const { return conditions_; }
  const std::vector<double>& errors() const { return errors_; }

  static std::vector<double> flat(const FourierSeries& series);
  FourierSeries series(const double* x) const;

 private:
  void make_shape();
  bool update(const double* x);
  Eigen::MatrixXd regressor_slopes() const;

  const dynamics::Model<double>& model_;
  const BaseParameters& base_;
  const ExcitationOptions& options_;
  int width_;  // coefficients of a joint
  Eigen::VectorXd times_;
  Eigen::MatrixXd basis_[3];
  NlpShape shape_;
  Interpreter slope_;
  Interpreter::Workspace workspace_;
  std::vector<double> conditions_, errors_;

  // Of the point looked at last.
  FourierSeries series_;
  Samples samples_;
  Eigen::MatrixXd displacements_, W_, R_;
  SingularValues svd_;
  bool usable_ = false;
  double value_ = 0, log_det_ = 0, condition_ = 0;
};

}  // namespace dyntape
