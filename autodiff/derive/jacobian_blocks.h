// SPDX-License-Identifier: BSD-3-Clause
//
// The non-zeros of a Jacobian.  Each block of rows and columns is derived in the direction that needs fewer
// operations.  Internal to the derivation.
#pragma once

#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

// Appends the entries of dy/dx to the graph of `function`: one node for each entry of `pattern`, in the same order.
std::vector<NodeId> append_jacobian(Function& function, Pattern& pattern);

}  // namespace dyntape
