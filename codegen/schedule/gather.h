// SPDX-License-Identifier: BSD-3-Clause
//
// Independent calls of one elementary function side by side, so that one call of its vector form computes them.
//
//   order = gather_calls(graph, order, functions);      // sin(q0), cos(q0), ..., sin(q5), cos(q5), and what they read before them
//
// Calls that depend on the same number of others, one behind the other, do not depend on each other: those of one function are
// brought together, of up to eight values, in their order.
#pragma once

#include <vector>

#include <dyntape/autodiff/graph/graph.h>
#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape::codegen {

inline constexpr std::size_t kGathered = 8;  // two registers of four

// A portable function of one value that is not a constant (autodiff/scalars/portable.h).
bool is_gathered(const Graph& graph, NodeId id, Functions functions);

// Sine and cosine go together: one call computes both.
constexpr Op team_operator(Op op) { return is_turn(op) ? Op::Sin : op; }

// `order`: nodes in an order in which they can be computed, without leaves and results of calls.
std::vector<NodeId> gather_calls(const Graph& graph, const std::vector<NodeId>& order, Functions functions);

}  // namespace dyntape::codegen
