// SPDX-License-Identifier: BSD-3-Clause
//
// Does every joint of a robot move some inertia?  Asked once, when a robot is loaded for forward dynamics.
//
//   check_forward_dynamics(model);      // NumericalError: joint "wrist" of model "arm" moves no inertia ...
//
// Inverse dynamics needs no such thing, and massless links and point masses are legal wherever some inertia
// about the joint remains: a massless link that carries a body, a point mass off its axis, an armature.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape::dynamics {

// Throws NumericalError naming the outermost joint whose acceleration is not determined at any configuration:
//   - what it carries has no inertia along it (to 1e-15 of the inertia about any axis: the rounding of a file), or
//   - joints further out take all of it, such as a second joint on the same axis.
// Decided on articulated inertias in 113 bits at three configurations.
void check_forward_dynamics(const Model<double>& model, const DynamicsTerms<double>& acting = {});

}  // namespace dyntape::dynamics
