// SPDX-License-Identifier: BSD-3-Clause
//
// Forward dynamics by the factors of M instead of articulated inertias, for recordings: inverse dynamics has M on
// the way anyway, and M = L^T D L, W = L^-1 in the order of the tree (dynamics/sparse_factor.h) cost less than
// the recursions of ABA and of M^-1.
//
//   for (Function& f : record_factored(model, RobotFunction::kFdDerivatives)) ...    the one with fewest operations
//
// Of derivatives the end is -M^-1 D, either with M^-1 itself, or, with fewer products where a tree branches, as
// -(W D^-1) (W^T D): a row of W has entries on its way to the root only.
#pragma once

#include <vector>

#include <dyntape/interface/function/robot_functions.h>

namespace dyntape::detail {

// The ways there are; none for other functions than minverse and fd-derivatives, or where joints follow others.
std::vector<Function> record_factored(const dynamics::Model<double>& model, const RobotFunction& function);

}  // namespace dyntape::detail
