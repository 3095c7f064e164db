// SPDX-License-Identifier: BSD-3-Clause
//
// Finite differences of the plain double dynamics, as robot_evaluator.h states them.  Internal.
#pragma once

#include <dyntape/dynamics/algorithms.h>
#include <dyntape/interface/function/robot_functions.h>

namespace dyntape::detail {

class RobotDifferences {
 public:
  // step: 0 for the default of the scheme.
  RobotDifferences(const dynamics::Model<double>& model, RobotFunction function, bool central, double step);

  // (q, v, w) -> three blocks (nv x nv), row by row.
  void operator()(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& w,
                  double* blocks);

 private:
  Eigen::VectorXd value(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& w);

  const dynamics::Model<double>& model_;
  dynamics::Data<double> data_;
  RobotFunction function_;  // rnea or aba
  bool central_;
  double step_;
  std::vector<int> scaled_by_;  // (nv) the entry of q that scales the step, or -1
};

}  // namespace dyntape::detail
