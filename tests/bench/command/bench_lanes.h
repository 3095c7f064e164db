// SPDX-License-Identifier: BSD-3-Clause
//
// What a state costs in generated kernels that take several at once.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape::tools {

struct LaneRow {
  std::string name;    // "generated, 8 lanes"
  double seconds = 0;  // a state
  double error = 0;    // against `expected`
  double prepare = 0, compile = 0;
  std::size_t operations = 0;
};

// With portable functions: one state after the other; the widest kernel of this processor from and to states one
// after the other; the same for states that are kept in lanes; both again with the non-zero results only, where there are zeros.
std::vector<LaneRow> measure_lanes(const dynamics::Model<double>& model, const RobotFunction& function,
                                   const std::vector<Eigen::VectorXd>& states,
                                   const std::vector<std::vector<double>>& expected);

}  // namespace dyntape::tools
