// SPDX-License-Identifier: BSD-3-Clause
//
// Copies a function node by node and replaces some nodes.
//
//   class Halves : public Rewriter {                                x / 2 -> 0.5 x
//     using Rewriter::Rewriter;
//     NodeId instead_of(NodeId, const Node& node) override {
//       if (node.op != Op::Div || !graph_.is_constant(node.b, 2)) return kNoNode;
//       return target_.make(Op::Mul, target_.constant(0.5), image_[node.a]);
//     }
//   };
//   Function halved = Halves(function, pinned_outputs).run();
//
// Pinned nodes are copied unchanged: the nodes that the first outputs and the guards depend on, and the arguments of
// roots, logarithms and other operators that are NaN beyond an end of their range.  Example: sqrt(x x - y y) is 0 at
// x = y because equal numbers are subtracted; with one rounding less, it is the root of a negative number.
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

class Rewriter {
 public:
  Rewriter(const Function& source, std::size_t pinned_outputs);
  virtual ~Rewriter() = default;

  Function run();

 protected:
  // The node of target_ that replaces node `id`, which is not pinned; kNoNode: a copy of the node.
  virtual NodeId instead_of(NodeId id, const Node& node) = 0;

  // The callee that replaces this callee; by default the same.
  virtual std::shared_ptr<const Callee> callee_instead_of(const std::shared_ptr<const Callee>& callee) {
    return callee;
  }

  bool is_pinned(NodeId id) const { return pinned_[id] != 0; }
  bool is_used_once(NodeId id) const { return uses_[id] == 1 && !is_pinned(id); }

  const Graph& graph_;
  Graph target_;
  std::vector<NodeId> image_;        // of the nodes so far, in target_
  std::vector<std::uint32_t> uses_;  // by nodes, outputs and guards

 private:
  NodeId copy(NodeId id);

  const Function& source_;
  std::vector<std::vector<NodeId>> results_;                                  // of call number i
  std::map<std::pair<NodeId, bool>, std::shared_ptr<const Callee>> callees_;  // met so far; pinned or not
  std::vector<std::uint8_t> pinned_;
};

}  // namespace dyntape::codegen
