// SPDX-License-Identifier: BSD-3-Clause
//
// A function at many states in packs, once: states (n_in x count), result (n_out x count).
#pragma once

#include <dyntape/interface/robot/packs/packed_robot.h>

namespace dyntape {

inline Eigen::MatrixXd evaluate_packed(const dynamics::Model<double>& model, const RobotFunction& function,
                                       const Eigen::MatrixXd& states) {
  PackedRobot robot(model, function);
  Eigen::MatrixXd results(static_cast<Eigen::Index>(robot.n_out()), states.cols());
  robot.evaluate(states.data(), static_cast<std::size_t>(states.cols()), results.data());
  return results;
}

}  // namespace dyntape
