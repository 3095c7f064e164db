// SPDX-License-Identifier: BSD-3-Clause
//
// Finite differences of the plain double dynamics, as robot_evaluator.h states them.  Internal.
#pragma once

#include <dyntape/interface/robot/robot_rows.h>

namespace dyntape::detail {

class RobotDifferences {
 public:
  // The value that `derivative` is of.  step: 0 for the default of the scheme.
  RobotDifferences(const dynamics::Model<double>& model, const RobotFunction& derivative, bool central,
                   double step);

  // State -> the blocks of the derivative.
  void operator()(const double* state, double* blocks);

 private:
  Eigen::VectorXd value();

  RobotWorkspace<double> work_;
  std::vector<RobotBlock> values_;
  std::vector<int> by_;
  bool central_;
  double step_;
  std::vector<int> scaled_by_;  // (nv) the entry of q that scales the step, or -1
};

}  // namespace dyntape::detail
