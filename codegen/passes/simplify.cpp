// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/passes/simplify.h>

#include <cmath>

#include <dyntape/codegen/passes/fuse.h>
#include <dyntape/codegen/passes/rewrite.h>

namespace dyntape::codegen {
namespace {

// Cheaper nodes for those that are not pinned.
class Relaxation : public Rewriter {
 public:
  Relaxation(const Function& source, std::size_t pinned_outputs)
      : Rewriter(source, pinned_outputs), divisions_(graph_.size(), 0) {
    for (NodeId id = 0; id < graph_.size(); ++id) {
      if (graph_[id].op != Op::Div) continue;
      const bool is_reciprocal =
          graph_.is_constant(graph_[id].a, 1);  // one that is there makes all others cheap
      divisions_[graph_[id].b] += is_reciprocal ? 2 : is_pinned(id) ? 0 : 1;
    }
  }

 private:
  NodeId instead_of(NodeId, const Node& node) override {
    if (node.op == Op::Div) return by_reciprocal(node);
    return node.op == Op::Add || node.op == Op::Sub ? factored(node) : kNoNode;
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

  std::vector<std::uint32_t> divisions_;  // by a node
};

// Roughly in units of an addition.
std::size_t cost_of(const Function& function) {
  std::size_t cost = 0;
  for (const OperationCount& entry : count_operations(function))
    cost += entry.count * (entry.op == Op::Div || entry.op == Op::Sqrt ? 4 : 1);
  return cost;
}

// Sums of many terms with one factor shrink by a term a round.
Function relaxed(const Function& function, std::size_t pinned_outputs, bool has_fma) {
  constexpr int kRounds = 8;
  Function best = function;
  std::size_t cost = cost_of(best);
  for (int round = 0; round < kRounds; ++round) {
    Function next = Relaxation(best, pinned_outputs).run();
    const std::size_t next_cost = cost_of(next);
    const bool gained = next_cost < cost;
    if (next_cost <= cost) best = std::move(next), cost = next_cost;
    if (!gained) break;
  }
  return has_fma ? fused(best, pinned_outputs) : best;
}

}  // namespace

Function simplify(const Function& function, Profile profile, bool has_fma) {
  return profile == Profile::kStrict ? function : relaxed(function, 0, has_fma);
}

Derivatives simplify(Derivatives derivatives, Profile profile, bool has_fma) {
  if (profile == Profile::kFast && derivatives.order != Order::kValue)
    derivatives.function = relaxed(derivatives.function, derivatives.n_y, has_fma);
  return derivatives;
}

}  // namespace dyntape::codegen
