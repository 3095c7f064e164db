// SPDX-License-Identifier: BSD-3-Clause
//
// Products of a root with itself, which have the slopes of all orders where the root has not.
//
//   root * root,  (k root) * (m root),  (root / s) * (root / s)       root: sqrt(a), abs(x) or hypot(x, y)
//
// become m (k a) if a cannot be negative by construction, (k x) (m x), and (k x) (m x) + (k y) (m y): so |x|^2 has the slope 0 and
// the curvature 2 at 0.  No intermediate result overflows or vanishes that did not before.  Internal.
#pragma once

#include <dyntape/autodiff/graph/node_table.h>
#include <dyntape/autodiff/graph/op.h>

namespace dyntape::detail {

constexpr bool is_root(Op op) { return op == Op::Sqrt || op == Op::Abs || op == Op::Hypot; }

// The root that a node is, or is a multiple of; kNoNode: none.
template <class Graph>
NodeId root_in(const Graph& graph, NodeId id) {
  const auto& node = graph[id];
  if (is_root(node.op)) return id;
  if (node.op != Op::Mul && node.op != Op::Div) return kNoNode;
  if (is_root(graph[node.a].op)) return node.a;
  return node.op == Op::Mul && is_root(graph[node.b].op) ? node.b : kNoNode;
}

// Whether both are multiples of the same root.
template <class Graph>
bool share_a_root(const Graph& graph, NodeId a, NodeId b) {
  if (!graph.has_roots()) return false;
  const NodeId root = root_in(graph, a);
  return root != kNoNode && root == root_in(graph, b);
}

}  // namespace dyntape::detail
