// SPDX-License-Identifier: BSD-3-Clause
//
// Forward and reverse sweeps that append the derivative of part of a graph to that same graph.
//
//   Sweep sweep(graph);
//   auto tangents = sweep.forward(roots, [&](std::uint32_t i) { return seed_of_variable(i); });
//   auto adjoints = sweep.reverse(roots, seeds);
//
// A sweep visits only the cone of its roots.  Internal to the derivation.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include <dyntape/autodiff/graph.h>

namespace dyntape {

class Sweep {
 public:
  // Sweeps the nodes that exist now; what it appends is not swept again by the same object.
  explicit Sweep(Graph& graph);

  // Tangents of the roots, given those of the variables; kNoNode stands for a structural zero.
  std::vector<NodeId> forward(const std::vector<NodeId>& roots,
                              const std::function<NodeId(std::uint32_t)>& seed);

  // Adjoints of the variables that the roots depend on, (index, node), given those of the roots.
  std::vector<std::pair<std::uint32_t, NodeId>> reverse(const std::vector<NodeId>& roots,
                                                        const std::vector<NodeId>& seeds);

 private:
  // The condition under which an adjoint is live: always, or where `condition` is non-zero (zero: !positive).
  struct Activity {
    NodeId condition = kNoNode;
    bool positive = true;
    bool always() const { return condition == kNoNode; }
    bool operator==(const Activity&) const = default;
  };
  struct Adjoint {
    NodeId value = kNoNode;
    Activity live;
  };

  // Adjoints of the results of a call, and the condition under which any of them is live.
  struct CallAdjoint {
    std::vector<NodeId> values;
    bool any = false;
    Activity live;
  };

  void find_active();
  std::vector<NodeId> cone(const std::vector<NodeId>& roots);
  NodeId tangent_of(NodeId id, const std::function<NodeId(std::uint32_t)>& seed);
  void forward_call(NodeId id);
  NodeId slope_of(NodeId id, int argument, NodeId v);
  void push_adjoint(NodeId id, const Adjoint& adjoint);
  void reverse_call(NodeId id);
  void accumulate(NodeId id, Adjoint more);
  NodeId masked(const Adjoint& adjoint);
  NodeId truth(const Activity& activity);
  bool both(const Activity& a, const Activity& b, Activity& result);
  Activity either(const Activity& a, const Activity& b);

  Graph& graph_;
  std::vector<NodeId> tangent_;
  std::vector<Adjoint> adjoint_;
  std::vector<std::uint32_t> mark_;
  std::uint32_t epoch_ = 0;
  std::vector<std::uint8_t> active_;                // whether the node depends on variables
  std::vector<std::vector<NodeId>> call_tangents_;  // of the results of call number i
  std::vector<CallAdjoint> call_adjoints_;          // collected so far, of call number i
};

}  // namespace dyntape
