// SPDX-License-Identifier: BSD-3-Clause
//
// An order of computation in which few values are live at a time, for processors whose numbers are all in registers: cards.
//
//   order = with_few_live(function, order);          // the recorded order, or another with clearly fewer live values
//
// List scheduling from the results backwards.  Of the values all of whose users have their places it takes that which makes
// the fewest arguments live, less those that it ends; of several the one that waits longest, or the last one recorded.  So
// a value is computed just before its first use, and what has been begun is finished first.
#pragma once

#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

// `order`: nodes in an order in which they can be computed, without leaves and results of calls.
std::vector<NodeId> with_few_live(const Function& function, const std::vector<NodeId>& order);

// Values that are live at once at most; inputs from their first use on.
std::size_t most_live(const Function& function, const std::vector<NodeId>& order);

}  // namespace dyntape::codegen
