// SPDX-License-Identifier: BSD-3-Clause
//
// Checks that effects fit a robot: sizes, ranges and bodies, as the parameters of each effect declare
// (parameters.h).
//
//   check(model, effects);    // "effects: joint damping: coefficient of joint "elbow" is -0.1 N m s/rad or
//                             //  N s/m, expected at least 0"
#pragma once

#include <dyntape/dynamics/effects/effects.h>

namespace dyntape::dynamics {

// Throws ArgumentError for the first problem.
void check(const Model<double>& model, const Effects<double>& effects);

}  // namespace dyntape::dynamics
