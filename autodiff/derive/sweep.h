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
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <dyntape/autodiff/derive/flow.h>
#include <dyntape/autodiff/derive/next_nodes.h>
#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/graph.h>

namespace dyntape {

// What a sweep starts from: a tangent or an adjoint, kNoNode for a structural zero.  With `alive` it contributes
// where that is not zero only, whatever it meets on its way.
struct Seed {
  NodeId value = kNoNode;
  NodeId alive = kNoNode;
  Seed(NodeId v, NodeId a = kNoNode) : value(v), alive(a) {}  // NOLINT: mostly just a node
  static Seed weight(NodeId w) { return {w, w}; }
};

class Sweep {
 public:
  // Of a callee the variables may be what a pole of its caller makes of them.
  enum class Variables { kFinite, kAny };
  static constexpr std::size_t kMostNodes = std::size_t{1} << 27;  // 3 GB

  // Sweeps the nodes that exist now; what it appends is not swept again by the same object.  RecordingError where
  // that would be more than `most` nodes: a dense Jacobian grows with rows times columns times what an entry takes.
  explicit Sweep(Graph& graph, Variables variables = Variables::kFinite, std::size_t most = kMostNodes);

  // Tangents of the roots, given those of the variables; kNoNode stands for a structural zero.
  std::vector<NodeId> forward(const std::vector<NodeId>& roots,
                              const std::function<Seed(std::uint32_t)>& seed);
  // A root that several have begun to watch is watched until all have ended it.
  void watch(NodeId root);
  void unwatch(NodeId root);
  // Tangents of roots that are watched where the tangent of one variable is 1 and those of the others are 0.
  std::vector<NodeId> forward(const std::vector<NodeId>& roots, std::uint32_t variable);

  // Adjoints of the variables that the roots depend on, (index, node), given those of the roots.
  std::vector<std::pair<std::uint32_t, NodeId>> reverse(const std::vector<NodeId>& roots,
                                                        const std::vector<Seed>& seeds);

  // How many nodes a sweep forward from a variable, or in reverse from a root, visits; counted up to `most`.
  std::size_t count_forward(std::uint32_t variable, std::size_t most);
  std::size_t count_reverse(NodeId root, std::size_t most);

 private:
  // Arguments of a derivative callee, and which of the seeds are there.
  struct CallSeeds {
    std::vector<NodeId> arguments;
    Seeds kinds;
  };

  void find_active(Variables variables);
  void check_size() const;
  void find_users();
  template <class Visit>
  void for_each_way_down(NodeId id, Visit&& visit) const;
  template <class Visit>
  void for_each_way_up(NodeId id, Visit&& visit) const;
  bool mark(NodeId id) { return mark_[id] != epoch_ && (mark_[id] = epoch_, true); }
  std::vector<NodeId> cone(const std::vector<NodeId>& roots);
  std::vector<NodeId> tangents_of(const std::vector<NodeId>& roots, const std::vector<NodeId>& visited);
  Flow started(const Seed& seed);
  Flow tangent_of(NodeId id, const std::function<Seed(std::uint32_t)>& seed);
  Flow passed(NodeId id, int argument, Flow flow);
  bool may_be_infinite(NodeId id, int argument) const;
  Seeds kinds_of(const std::vector<Flow>& flows, const Callee& callee);
  CallSeeds call_seeds(NodeId id, const std::vector<Flow>& flows);
  std::vector<Flow> call_results(NodeId id, const std::vector<NodeId>& values, const std::vector<Flow>& flows,
                                 bool transposed);
  void forward_call(NodeId id);
  void push_adjoint(NodeId id, const Flow& adjoint);
  void reverse_call(NodeId id);

  Graph& graph_;
  const std::size_t most_;
  Flows flows_;
  std::vector<Flow> tangent_;
  std::vector<Flow> adjoint_;
  std::vector<std::uint32_t> mark_;
  std::uint32_t epoch_ = 0;
  NextNodes next_;                      // of a sweep forward from one variable
  std::vector<std::uint8_t> active_;    // whether the node depends on variables
  std::vector<std::uint8_t> wild_;      // whether it may be infinite though no variable is
  std::vector<NodeId> variables_;       // the node of each; kNoNode: there is none
  std::vector<std::uint32_t> watched_;  // ways from the node to roots that are watched, its own included
  // users_[first_user_[id]] and on: those by for_each_way_down
  std::vector<std::uint32_t> first_user_, users_;
  std::vector<std::vector<Flow>> call_tangents_;          // of the results of call number i
  std::vector<std::vector<Flow>> call_adjoints_;          // collected so far, of call number i
  std::map<const Callee*, std::set<Seeds>> ways_called_;  // those that have a derivative of their own
};

}  // namespace dyntape
