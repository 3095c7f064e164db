// SPDX-License-Identifier: BSD-3-Clause
//
// Records forward dynamics by the factors of M instead of articulated inertias.  Inverse dynamics computes M anyway;
// M = L^T D L and W = L^-1 in the order of the tree (dynamics/algorithms/sparse_factor.h) cost less than the
// recursions of ABA and of M^-1.
//
//   for (Function& f : record_factored(model, RobotFunction::kFdDerivatives)) ...    the version with the fewest operations
//
// Derivatives end with -M^-1 D: either with M^-1, or, with fewer products in a branching tree, as -(W D^-1) (W^T D),
// because a row of W has entries only on its way to the root.
//
// The pivots D are differences of entries of M and lose digits with the condition of M
// (dynamics/algorithms/inertia_condition.h): 1e16 for two parallel joints with a lever of 1e-8; 3 to 700 for the
// robots of config/robots, except g1 (8000).  Above 1e3, articulated inertias are recorded instead.
#pragma once

#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/robot/robot_function.h>

namespace dyntape::detail {

// All versions.  None for functions other than minverse and fd-derivatives, for joints that follow others, and for
// an ill-conditioned inertia matrix.
std::vector<Function> record_factored(const dynamics::Model<double>& model, const RobotFunction& function);

}  // namespace dyntape::detail
