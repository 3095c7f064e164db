// SPDX-License-Identifier: BSD-3-Clause
//
// Limits of joints that others follow.
#pragma once

#include <dyntape/dynamics/model/model.h>

#include "../robot.h"

namespace dyntape::python {

// The robot's model; joints have the limits within which those that follow them keep theirs.
dynamics::Model<double> with_tied_limits(const Robot& robot);

}  // namespace dyntape::python
