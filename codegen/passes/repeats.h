// SPDX-License-Identifier: BSD-3-Clause
//
// Parts of a graph that are there several times, such as the legs of a robot: the same operators on other inputs
// and with other constants.
//
//   const Repeats r = find_repeats(function);
//   r.count                                4
//   r.nodes[k][0], ..., r.nodes[k][3]      the k-th node of each part, in the order of the first part's
//
// How they are found.  Nodes get a shape: their operator and the shapes of their arguments, all inputs being
// alike and all constants.  Four nodes of one shape suggest four parts; walking down from them in step leads to
// four inputs at a time, each of another part.  From the inputs upwards a node then belongs to the part that all
// its arguments belong to that belong to one, and to none where parts meet, like the sum of what the legs exert.
// Nodes of different parts correspond if their operators and arguments do.
//
// Time is linear in the graph.  All returned parts are equal.  The heuristic only affects how many are found.
#pragma once

#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

inline bool is_operation(const Node& node) { return static_cast<int>(node.op) < kTableOps; }

struct Repeats {
  std::size_t count = 0;  // parts; 0: nothing is repeated
  std::vector<std::vector<NodeId>> nodes;
};

Repeats find_repeats(const Function& function);

}  // namespace dyntape::codegen
