// SPDX-License-Identifier: BSD-3-Clause
//
// One line on stderr where accelerations of a robot are badly determined (dynamics/algorithms/inertia_condition.h).  Internal.
#pragma once

#include <dyntape/interface/robot/robot_functions.h>

namespace dyntape::detail {

// For functions that solve for accelerations, where the condition of the inertia matrix is above 1e12.
void note_condition(const dynamics::Model<double>& model, const RobotFunction& function);

}  // namespace dyntape::detail
