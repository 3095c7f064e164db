// SPDX-License-Identifier: BSD-3-Clause
//
// Checks whether the accelerations of a robot are determined, and how well
// (dynamics/algorithms/inertia_condition.h).  Internal.
#pragma once

#include <dyntape/interface/robot/robot_function.h>

namespace dyntape::detail {

// For functions that solve for accelerations.  NumericalError: a joint has no inertia.  Prints one line on stderr if
// the condition of the inertia matrix is above 1e12.
void check_accelerations(const dynamics::Model<double>& model, const RobotFunction& function);

}  // namespace dyntape::detail
