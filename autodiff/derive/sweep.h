// SPDX-License-Identifier: BSD-3-Clause
//
// Forward and reverse sweeps, which append the derivative of a part of a graph to the same graph.
//
//   Sweep sweep(graph);
//   auto tangents = sweep.forward(roots, [&](std::uint32_t i) { return seed_of_variable(i); });
//   auto adjoints = sweep.reverse(roots, seeds);
//
// A sweep visits only the nodes that its roots depend on.  Internal to the derivation.
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

// The start of a sweep: a tangent or an adjoint; kNoNode: a structural zero.  With `alive`, the seed contributes
// only where `alive` is not zero, for any values on its way.
struct Seed {
  NodeId value = kNoNode;
  NodeId alive = kNoNode;
  Seed(NodeId v, NodeId a = kNoNode) : value(v), alive(a) {}  // NOLINT: mostly just a node
  static Seed weight(NodeId w) { return {w, w}; }
};

class Sweep {
 public:
  // Variables of a callee may take the values that a pole of the caller gives.
  enum class Variables { kFinite, kAny };
  static constexpr std::size_t kMostNodes = std::size_t{1} << 27;  // 3 GB

  // Sweeps the nodes that exist now; later sweeps of this object do not visit appended nodes.  RecordingError: more
  // than `most` nodes would be appended.  A dense Jacobian grows with rows times columns times the nodes of an
  // entry.
  explicit Sweep(Graph& graph, Variables variables = Variables::kFinite, std::size_t most = kMostNodes);

  // Tangents of the roots, from the tangents of the variables; kNoNode: a structural zero.
  std::vector<NodeId> forward(const std::vector<NodeId>& roots,
                              const std::function<Seed(std::uint32_t)>& seed);
  // A root that several callers watch is watched until each of them ends the watch.
  void watch(NodeId root);
  void unwatch(NodeId root);
  // Tangents of the watched roots, with tangent 1 for one variable and 0 for the others.
  std::vector<NodeId> forward(const std::vector<NodeId>& roots, std::uint32_t variable);

  // Adjoints (index, node) of the variables that the roots depend on, from the adjoints of the roots.
  std::vector<std::pair<std::uint32_t, NodeId>> reverse(const std::vector<NodeId>& roots,
                                                        const std::vector<Seed>& seeds);

  // The number of nodes that a sweep visits, forward from a variable or in reverse from a root; counts up to `most`.
  std::size_t count_forward(std::uint32_t variable, std::size_t most);
  std::size_t count_reverse(NodeId root, std::size_t most);

 private:
  // Arguments of a derivative callee, and the seeds that exist.
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
  NextNodes next_;                    // of a sweep forward from one variable
  std::vector<std::uint8_t> active_;  // whether the node depends on variables
  std::vector<std::uint8_t> wild_;    // whether the node may be infinite although no variable is
  std::vector<NodeId> variables_;     // the node of each variable; kNoNode: none
  std::vector<std::uint32_t>
      watched_;  // numbers of ways from the node to watched roots, including the node itself
  // users_[first_user_[id]] and on: those by for_each_way_down
  std::vector<std::uint32_t> first_user_, users_;
  std::vector<std::vector<Flow>> call_tangents_;          // of the results of call number i
  std::vector<std::vector<Flow>> call_adjoints_;          // the sums so far, of call number i
  std::map<const Callee*, std::set<Seeds>> ways_called_;  // callees with given derivatives
};

}  // namespace dyntape
