// SPDX-License-Identifier: BSD-3-Clause
//
// Limits of joints that others follow.
#pragma once

#include <dyntape/dynamics/model/model.h>

#include "../robot.h"

namespace dyntape::python {

// The limits of a joint, narrowed to those within which the joints that follow it keep theirs.
dynamics::JointLimits limits_with_followers(const Robot& robot, const dynamics::Joint<double>& joint);

}  // namespace dyntape::python
