// SPDX-License-Identifier: BSD-3-Clause
//
// Checks that every joint of a robot moves some inertia.  Call it once after loading a robot for forward dynamics.
//
//   check_forward_dynamics(model);      // NumericalError: joint "wrist" of model "arm" moves no inertia ...
//
// Inverse dynamics does not need this check.  Massless links and point masses are valid if some inertia about the
// joint remains: a massless link that carries a body, a point mass off its axis, an armature.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape::dynamics {

// Throws NumericalError that names the outermost joint whose acceleration is undetermined at every configuration:
//   - the bodies that it carries have no inertia along it (below 1e-15 of the inertia about any axis), or
//   - joints further out take all of this inertia, e.g. a second joint on the same axis.
// Method: articulated inertias in 113 bits at three configurations.
void check_forward_dynamics(const Model<double>& model, const DynamicsTerms<double>& acting = {});

}  // namespace dyntape::dynamics
