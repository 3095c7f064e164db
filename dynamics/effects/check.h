// SPDX-License-Identifier: BSD-3-Clause
//
// Whether effects fit a robot: sizes, ranges and bodies, from what each effect tells of its values (parameters.h).
//
//   check(model, effects);    // "effects: joint damping: coefficient of joint "elbow" is -0.1 N m s/rad or
//                             //  N s/m, expected at least 0"
#pragma once

#include <dyntape/dynamics/effects/effects.h>

namespace dyntape::dynamics {

// ArgumentError: what is wrong first.
void check(const Model<double>& model, const Effects<double>& effects);

}  // namespace dyntape::dynamics
