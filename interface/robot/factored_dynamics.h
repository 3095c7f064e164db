// SPDX-License-Identifier: BSD-3-Clause
//
// Forward dynamics by the factors of M instead of articulated inertias, for recordings: inverse dynamics has M on
// the way anyway, and M = L^T D L, W = L^-1 in the order of the tree (dynamics/algorithms/sparse_factor.h) cost less than
// the recursions of ABA and of M^-1.
//
//   for (Function& f : record_factored(model, RobotFunction::kFdDerivatives)) ...    the one with fewest operations
//
// Of derivatives the end is -M^-1 D, either with M^-1 itself, or, with fewer products where a tree branches, as
// -(W D^-1) (W^T D): a row of W has entries on its way to the root only.
//
// The pivots D are differences of entries of M: what is lost in them is the condition of M (dynamics/algorithms/inertia_condition.h),
// 1e16 for two parallel joints with a lever of 1e-8, and 3 to 700 for the robots of config/robots but one (g1: 8000).
// Above 1e3 there is no such recording, and articulated inertias are recorded.
#pragma once

#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/robot/robot_function.h>

namespace dyntape::detail {

// The ways there are; none for other functions than minverse and fd-derivatives, where joints follow others, or where
// the inertia matrix is badly conditioned.
std::vector<Function> record_factored(const dynamics::Model<double>& model, const RobotFunction& function);

}  // namespace dyntape::detail
