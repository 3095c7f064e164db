// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/graph.h>

namespace dyntape {
namespace {

// The nodes of the last long graph that this thread destroyed; very long ones are given back.
constexpr std::size_t kMostKept = std::size_t{1} << 20;
constinit thread_local bool kept_is_gone = false;
struct Kept {
  ~Kept() { kept_is_gone = true; }
  std::vector<Node> nodes;
};
thread_local Kept last_long;

std::vector<Node> memory_for(std::size_t nodes) {
  if (kept_is_gone || last_long.nodes.capacity() < nodes || last_long.nodes.capacity() > nodes + nodes / 4)
    return {};
  return std::move(last_long.nodes);
}

}  // namespace

void Graph::keep_memory() {
  if (!kept_is_gone && nodes_.capacity() <= kMostKept) last_long.nodes = std::move(nodes_);
}

// Nodes that are left out are written, and written over: neither is asked about node by node.
Graph Graph::extract(const std::vector<std::uint8_t>& keep, std::size_t n_kept,
                     std::vector<NodeId>& image) const {
  Graph copy;
  copy.nodes_ = memory_for(n_kept + 1);
  copy.nodes_.resize(n_kept + 1, Node{Op::Const});
  const auto n = static_cast<NodeId>(nodes_.size());
  image.resize(nodes_.size() + 1);
  image[n] = kNoNode;  // that of arguments that an operator does not have
  const Node* const from = nodes_.data();
  const std::uint8_t* const kept = keep.data();
  NodeId* const to = image.data();
  Node* next = copy.nodes_.data();
  NodeId place = 0;
  for (NodeId id = 0; id < n; ++id) {
    const Node& node = from[id];
    if (is_table_op(node.op)) {
      next->op = node.op;
      next->a = to[node.a];
      next->b = to[std::min(node.b, n)];
      next->c = node.c == kNoNode ? kNoNode : to[node.c];
    } else if (kept[id]) {
      *next = copy.structural_copy(*this, node, image);
    }
    const std::uint32_t added = kept[id];
    to[id] = place | (added - 1);  // kNoNode unless it is added
    place += added;
    next += added;
  }
  copy.nodes_.pop_back();
  copy.has_roots_ = has_roots_;
  return copy;
}

Node Graph::structural_copy(const Graph& source, const Node& node, const std::vector<NodeId>& image) {
  switch (node.op) {
    case Op::Call:
      return copy_call(source, node, image);
    case Op::Const:
      constants_.push_back(source.constants_[node.a]);
      return {Op::Const, static_cast<NodeId>(constants_.size() - 1), kNoNode, kNoNode};
    case Op::Result:
      return {Op::Result, image[node.a], node.b, kNoNode};
    default:
      return node;
  }
}

Node Graph::copy_call(const Graph& source, const Node& node, const std::vector<NodeId>& image) {
  const auto& callee = source.callees_[node.a];
  const auto first = static_cast<NodeId>(call_arguments_.size());
  for (std::size_t i = 0; i < callee->n_in; ++i) {
    call_arguments_.push_back(image[source.call_arguments_[node.b + i]]);
  }
  return {Op::Call, place_of(callee), first, n_calls_++};
}

}  // namespace dyntape
