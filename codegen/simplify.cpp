// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/simplify.h>

#include <algorithm>
#include <cmath>

namespace dyntape::codegen {
namespace {

// Copies a graph, node by node, with cheaper nodes for those that are not pinned.
class Rewriter {
 public:
  Rewriter(const Function& source, std::size_t pinned_outputs)
      : source_(source),
        graph_(source.graph),
        image_(graph_.size(), kNoNode),
        uses_(graph_.size(), 0),
        divisions_(graph_.size(), 0),
        pinned_(graph_.size(), 0) {
    for (std::size_t i = 0; i < pinned_outputs; ++i) pinned_[source.outputs[i]] = 1;
    for (const Guard& guard : source.guards) pinned_[guard.condition] = 1;
    for (auto id = static_cast<NodeId>(graph_.size()); id-- > 0;) {
      graph_.for_each_argument(id, [&](NodeId a) {
        ++uses_[a];
        pinned_[a] |= pinned_[id];
      });
      if (graph_[id].op != Op::Div) continue;
      const bool is_reciprocal =
          graph_.is_constant(graph_[id].a, 1);  // one that is there makes all others cheap
      divisions_[graph_[id].b] += is_reciprocal ? 2 : pinned_[id] ? 0 : 1;
    }
    for (NodeId id : source.outputs) ++uses_[id];
    for (const Guard& guard : source.guards) ++uses_[guard.condition];
  }

  Function run() {
    for (NodeId id = 0; id < graph_.size(); ++id) image_[id] = copy(id);
    Function result{source_.name,   source_.inputs,      std::move(target_),  source_.outputs,
                    source_.guards, source_.input_names, source_.output_names};
    for (NodeId& id : result.outputs) id = image_[id];
    for (Guard& guard : result.guards) guard.condition = image_[guard.condition];
    return compact(result);
  }

 private:
  NodeId copy(NodeId id) {
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
        results_[node.c] = target_.call(graph_.callees()[node.a], arguments);
        return results_[node.c].empty() ? kNoNode : results_[node.c][0];  // nobody asks for a call itself
      }
      case Op::Result:
        return results_[graph_[node.a].c][node.b];
      default:
        break;
    }
    NodeId cheaper = kNoNode;
    if (!pinned_[id] && node.op == Op::Div) cheaper = by_reciprocal(node);
    if (!pinned_[id] && (node.op == Op::Add || node.op == Op::Sub)) cheaper = factored(node);
    if (cheaper != kNoNode) return cheaper;
    const int arity = info(node.op).arity;
    return target_.make(node.op, image_[node.a], arity > 1 ? image_[node.b] : kNoNode,
                        arity > 2 ? image_[node.c] : kNoNode);
  }

  NodeId by_reciprocal(const Node& node) {
    if (graph_.is_constant(node.a)) return kNoNode;  // it is a reciprocal, or costs the same
    const bool constant = graph_.is_constant(node.b);
    if (constant ? !std::isnormal(1.0 / graph_.constant_value(node.b)) : divisions_[node.b] < 2)
      return kNoNode;
    const NodeId reciprocal = target_.make(Op::Div, target_.constant(1), image_[node.b]);
    return target_.make(Op::Mul, image_[node.a], reciprocal);
  }

  // a x + a y -> a (x + y) and x / d + y / d -> (x + y) / d, where the terms are needed nowhere else.
  NodeId factored(const Node& node) {
    const Node &left = graph_[node.a], &right = graph_[node.b];
    const bool foldable =
        node.a != node.b && left.op == right.op && is_used_once(node.a) && is_used_once(node.b);
    if (!foldable || (left.op != Op::Mul && left.op != Op::Div)) return kNoNode;
    if (left.op == Op::Div) {
      if (left.b != right.b || divisions_[left.b] > 2) return kNoNode;
      return target_.make(Op::Div, target_.make(node.op, image_[left.a], image_[right.a]), image_[left.b]);
    }
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        if (left.argument(i) != right.argument(j)) continue;
        const NodeId sum = target_.make(node.op, image_[left.argument(1 - i)], image_[right.argument(1 - j)]);
        return target_.make(Op::Mul, image_[left.argument(i)], sum);
      }
    }
    return kNoNode;
  }

  bool is_used_once(NodeId id) const { return uses_[id] == 1 && !pinned_[id]; }

  const Function& source_;
  const Graph& graph_;
  Graph target_;
  std::vector<NodeId> image_;
  std::vector<std::vector<NodeId>> results_;  // of call number i
  std::vector<std::uint32_t> uses_, divisions_;
  std::vector<std::uint8_t> pinned_;
};

// Roughly in units of an addition.
std::size_t cost_of(const Function& function) {
  std::size_t cost = 0;
  for (const OperationCount& entry : count_operations(function))
    cost += entry.count * (entry.op == Op::Div || entry.op == Op::Sqrt ? 4 : 1);
  return cost;
}

// Sums of many terms with one factor shrink by a term a round.
Function relaxed(const Function& function, std::size_t pinned_outputs) {
  constexpr int kRounds = 8;
  Function best = function;
  std::size_t cost = cost_of(best);
  for (int round = 0; round < kRounds; ++round) {
    Function next = Rewriter(best, pinned_outputs).run();
    const std::size_t next_cost = cost_of(next);
    const bool gained = next_cost < cost;
    if (next_cost <= cost) best = std::move(next), cost = next_cost;
    if (!gained) break;
  }
  return best;
}

}  // namespace

Function simplify(const Function& function, Profile profile) {
  return profile == Profile::kStrict ? function : relaxed(function, 0);
}

Derivatives simplify(Derivatives derivatives, Profile profile) {
  if (profile == Profile::kFast && derivatives.order != Order::kValue)
    derivatives.function = relaxed(derivatives.function, derivatives.n_y);
  return derivatives;
}

}  // namespace dyntape::codegen
