// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/passes/rewrite.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <dyntape/autodiff/graph/callee.h>

namespace dyntape::codegen {
namespace {

// Operators that are NaN of some numbers.
bool is_partial(Op op) {
  static const std::array<bool, kTableOps> partial = [] {
    constexpr double kNumbers[] = {-2, -0.5, 0.5, 2};
    std::array<bool, kTableOps> found{};
    for (int i = 0; i < kTableOps; ++i) {
      for (double x : kNumbers) {
        for (double y : kNumbers) found[i] |= std::isnan(evaluate<double>(static_cast<Op>(i), x, y, 1));
      }
    }
    return found;
  }();
  return is_table_op(op) && partial[static_cast<std::size_t>(op)];
}

// A kernel that does not say what it does may do that.
bool is_partial(const Callee& callee) {
  const auto operations = count_operations(callee);
  if (callee.kernel() && operations.empty()) return true;
  return std::any_of(operations.begin(), operations.end(),
                     [](const OperationCount& entry) { return is_partial(entry.op); });
}

}  // namespace

Rewriter::Rewriter(const Function& source, std::size_t pinned_outputs)
    : graph_(source.graph),
      image_(graph_.size(), kNoNode),
      uses_(graph_.size(), 0),
      source_(source),
      pinned_(graph_.size(), 0) {
  for (std::size_t i = 0; i < pinned_outputs; ++i) pinned_[source.outputs[i]] = 1;
  for (const Guard& guard : source.guards) pinned_[guard.condition] = 1;
  std::vector<std::uint8_t> partial;  // by callee
  for (const auto& callee : graph_.callees()) partial.push_back(is_partial(*callee));
  for (auto id = static_cast<NodeId>(graph_.size()); id-- > 0;) {
    const Node& node = graph_[id];
    const bool pins = pinned_[id] || (node.op == Op::Call ? partial[node.a] != 0 : is_partial(node.op));
    graph_.for_each_argument(id, [&](NodeId a) {
      ++uses_[a];
      pinned_[a] |= pins;
    });
  }
  for (NodeId id : source.outputs) ++uses_[id];
  for (const Guard& guard : source.guards) ++uses_[guard.condition];
}

Function Rewriter::run() {
  for (NodeId id = 0; id < graph_.size(); ++id) image_[id] = copy(id);
  Function result{source_.name,   source_.inputs,      std::move(target_),  source_.outputs,
                  source_.guards, source_.input_names, source_.output_names};
  for (NodeId& id : result.outputs) id = image_[id];
  for (Guard& guard : result.guards) guard.condition = image_[guard.condition];
  return compact(result);
}

NodeId Rewriter::copy(NodeId id) {
  const Node node = graph_[id];
  switch (node.op) {
    case Op::Const:
      return target_.constant(graph_.constant_value(id));
    case Op::Input:
      return target_.input(static_cast<Block>(node.a), node.b);
    case Op::Call: {
      std::vector<NodeId> arguments;
      graph_.for_each_argument(id, [&](NodeId a) { arguments.push_back(image_[a]); });
      results_.resize(std::max<std::size_t>(results_.size(), node.c + 1));
      auto& callee = callees_[{node.a, is_pinned(id)}];
      if (!callee)
        callee = is_pinned(id) ? graph_.callees()[node.a] : callee_instead_of(graph_.callees()[node.a]);
      results_[node.c] = target_.call(callee, arguments);
      return results_[node.c].empty() ? kNoNode : results_[node.c][0];  // nobody asks for a call itself
    }
    case Op::Result:
      return results_[graph_[node.a].c][node.b];
    default:
      break;
  }
  if (!is_pinned(id)) {
    if (const NodeId other = instead_of(id, node); other != kNoNode) return other;
  }
  const int arity = info(node.op).arity;
  return target_.make(node.op, image_[node.a], arity > 1 ? image_[node.b] : kNoNode,
                      arity > 2 ? image_[node.c] : kNoNode);
}

}  // namespace dyntape::codegen
