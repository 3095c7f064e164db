// SPDX-License-Identifier: BSD-3-Clause
//
// The non-zeros of a Jacobian, each block of rows and columns in the direction that needs fewer operations.
// Internal to the derivation.
#pragma once

#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

// Appends the entries of dy/dx to the graph of `function`; one node an entry of `pattern`, in its order.
std::vector<NodeId> append_jacobian(Function& function, Pattern& pattern);

}  // namespace dyntape
