// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/sweep.h>

#include <algorithm>

#include <dyntape/autodiff/callee.h>
#include <dyntape/autodiff/expr.h>

namespace dyntape {

Sweep::Sweep(Graph& graph) : graph_(graph), mark_(graph.size(), 0) { find_active(); }

// Variables and what depends on them through a slope.
void Sweep::find_active() {
  active_.resize(graph_.size());
  for (NodeId id = 0; id < graph_.size(); ++id) {
    const Node& node = graph_[id];
    bool active = node.op == Op::Input && node.a == static_cast<NodeId>(Block::kVariables);
    if (node.op == Op::Call || node.op == Op::Result) {
      graph_.for_each_argument(id, [&](NodeId a) { active |= active_[a] != 0; });
    } else {
      for (int i = 0; i < info(node.op).arity; ++i)
        active |= has_slope(node.op, i) && active_[node.argument(i)];
    }
    active_[id] = active;
  }
}

// What becomes of v on its way through an argument of a node.
NodeId Sweep::slope_of(NodeId id, int argument, NodeId v) {
  const Node node = graph_[id];
  return slope<Expr>(node.op, argument, Expr(node.a), Expr(node.b), Expr(node.c), Expr(id), Expr(v)).id;
}

std::vector<NodeId> Sweep::cone(const std::vector<NodeId>& roots) {
  ++epoch_;
  std::vector<NodeId> ids, stack;
  const auto push = [&](NodeId id) {
    if (mark_[id] != epoch_) mark_[id] = epoch_, stack.push_back(id);
  };
  for (NodeId root : roots) push(root);
  while (!stack.empty()) {
    const NodeId id = stack.back();
    stack.pop_back();
    ids.push_back(id);
    graph_.for_each_argument(id, push);
  }
  if (ids.size() > mark_.size() / 16) {  // dense: reading the marks in order is cheaper than sorting
    ids.clear();
    for (NodeId id = 0; id < mark_.size(); ++id) {
      if (mark_[id] == epoch_) ids.push_back(id);
    }
  } else {
    std::sort(ids.begin(), ids.end());
  }
  return ids;
}

// --- forward ---

std::vector<NodeId> Sweep::forward(const std::vector<NodeId>& roots,
                                   const std::function<NodeId(std::uint32_t)>& seed) {
  const GraphScope scope(graph_);
  tangent_.resize(mark_.size(), kNoNode);
  const std::vector<NodeId> ids = cone(roots);
  for (NodeId id : ids) tangent_[id] = active_[id] ? tangent_of(id, seed) : kNoNode;
  std::vector<NodeId> result;
  for (NodeId root : roots) result.push_back(tangent_[root]);
  for (NodeId id : ids) tangent_[id] = kNoNode;
  call_tangents_.clear();
  return result;
}

NodeId Sweep::tangent_of(NodeId id, const std::function<NodeId(std::uint32_t)>& seed) {
  const Node node = graph_[id];
  switch (node.op) {
    case Op::Const:
      return kNoNode;
    case Op::Input:
      return node.a == static_cast<NodeId>(Block::kVariables) ? seed(node.b) : kNoNode;
    case Op::Call:
      forward_call(id);
      return kNoNode;
    case Op::Result: {
      const auto& tangents = call_tangents_[graph_[node.a].c];
      return tangents.empty() ? kNoNode : tangents[node.b];
    }
    default:
      break;
  }
  // dr = sum over arguments of slope_i(d argument_i)
  NodeId sum = kNoNode;
  for (int i = 0; i < info(node.op).arity; ++i) {
    const NodeId v = tangent_[node.argument(i)];
    if (v == kNoNode || !has_slope(node.op, i)) continue;
    const NodeId term = slope_of(id, i, v);
    sum = sum == kNoNode ? term : graph_.make(Op::Add, sum, term);
  }
  // A tangent that came out as the constant 0 is as good as none.
  return sum != kNoNode && graph_.is_constant(sum, 0) ? kNoNode : sum;
}

void Sweep::forward_call(NodeId id) {
  const Node call = graph_[id];
  const std::shared_ptr<const Callee> callee = graph_.callees()[call.a];
  call_tangents_.resize(std::max<std::size_t>(call_tangents_.size(), call.c + 1));
  std::vector<NodeId> arguments, tangents;
  bool any = false;
  graph_.for_each_argument(id, [&](NodeId a) {
    arguments.push_back(a);
    any = any || tangent_[a] != kNoNode;
  });
  if (!any) return;
  for (NodeId a : arguments) tangents.push_back(tangent_[a] != kNoNode ? tangent_[a] : graph_.constant(0));
  std::vector<bool> reached(callee->n_out, callee->pattern.rows == 0);
  for (std::size_t k = 0; k < callee->pattern.nnz(); ++k) {
    if (tangent_[arguments[callee->pattern.col[k]]] != kNoNode) reached[callee->pattern.row[k]] = true;
  }
  arguments.insert(arguments.end(), tangents.begin(), tangents.end());
  std::vector<NodeId> results = graph_.call(jvp_callee(callee), arguments);
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!reached[i]) results[i] = kNoNode;
  }
  call_tangents_[call.c] = std::move(results);
}

// --- reverse ---

std::vector<std::pair<std::uint32_t, NodeId>> Sweep::reverse(const std::vector<NodeId>& roots,
                                                             const std::vector<NodeId>& seeds) {
  const GraphScope scope(graph_);
  adjoint_.resize(mark_.size());
  const std::vector<NodeId> ids = cone(roots);
  for (std::size_t i = 0; i < roots.size(); ++i) {
    if (seeds[i] != kNoNode && !graph_.is_constant(seeds[i], 0)) accumulate(roots[i], {seeds[i], {}});
  }
  std::vector<std::pair<std::uint32_t, NodeId>> result;
  for (auto it = ids.rbegin(); it != ids.rend(); ++it) {
    const NodeId id = *it;
    const Adjoint adjoint = adjoint_[id];
    adjoint_[id] = {};
    const Node node = graph_[id];
    if (node.op == Op::Call) {
      reverse_call(id);
    } else if (adjoint.value == kNoNode) {
      continue;
    } else if (node.op == Op::Input) {
      const NodeId value = masked(adjoint);
      if (!graph_.is_constant(value, 0)) result.emplace_back(node.b, value);
    } else {
      push_adjoint(id, adjoint);
    }
  }
  call_adjoints_.clear();
  std::sort(result.begin(), result.end());
  return result;
}

void Sweep::push_adjoint(NodeId id, const Adjoint& adjoint) {
  const Node node = graph_[id];
  if (node.op == Op::Result) {
    const Node call = graph_[node.a];
    call_adjoints_.resize(std::max<std::size_t>(call_adjoints_.size(), call.c + 1));
    CallAdjoint& collected = call_adjoints_[call.c];
    collected.values.resize(graph_.callees()[call.a]->n_out, kNoNode);
    collected.values[node.b] = masked(adjoint);
    collected.live = collected.any ? either(collected.live, adjoint.live) : adjoint.live;
    collected.any = true;
    return;
  }
  for (int i = 0; i < info(node.op).arity; ++i) {
    const NodeId argument = node.argument(i);
    if (!active_[argument] || !has_slope(node.op, i)) continue;
    accumulate(argument, {slope_of(id, i, adjoint.value), adjoint.live});
  }
}

void Sweep::reverse_call(NodeId id) {
  const Node call = graph_[id];
  if (call.c >= call_adjoints_.size() || !call_adjoints_[call.c].any) return;
  const CallAdjoint& collected = call_adjoints_[call.c];
  const std::shared_ptr<const Callee> callee = graph_.callees()[call.a];
  std::vector<NodeId> arguments;
  graph_.for_each_argument(id, [&](NodeId a) { arguments.push_back(a); });
  std::vector<NodeId> all = arguments;
  for (NodeId adjoint : collected.values) all.push_back(adjoint != kNoNode ? adjoint : graph_.constant(0));
  const std::vector<NodeId> results = graph_.call(vjp_callee(callee), all);
  const Pattern& pattern = callee->pattern;
  std::vector<bool> reached(arguments.size(), pattern.rows == 0);
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    if (collected.values[pattern.row[k]] != kNoNode) reached[pattern.col[k]] = true;
  }
  // Where no result is live the callee works on zeros, which its poles may turn into NaN: cut off as well.
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (reached[i] && active_[arguments[i]]) accumulate(arguments[i], {results[i], collected.live});
  }
}

// Adds to the adjoint of a node.  A contribution of the form select(c, v, 0) is taken as v, live where c
// holds: what a branch that is not taken makes of v on its way down (0 * inf, for one) is cut off at the end.
void Sweep::accumulate(NodeId id, Adjoint more) {
  if (!active_[id] || graph_.is_constant(more.value, 0)) return;
  for (Node s = graph_[more.value]; s.op == Op::Select; s = graph_[more.value]) {
    const bool zero_if_true = graph_.is_constant(s.b, 0), zero_if_false = graph_.is_constant(s.c, 0);
    if (!zero_if_true && !zero_if_false) break;
    Activity live;
    if (!both(more.live, {s.a, zero_if_false}, live)) return;  // never live
    more = {zero_if_false ? s.b : s.c, live};
  }
  Adjoint& sum = adjoint_[id];
  if (sum.value == kNoNode) {
    sum = more;
  } else if (sum.live == more.live) {
    sum.value = graph_.make(Op::Add, sum.value, more.value);
  } else if (!sum.live.always() && sum.live.condition == more.live.condition) {  // one each way
    const bool first = sum.live.positive;
    sum.value = graph_.make(Op::Select, sum.live.condition, first ? sum.value : more.value,
                            first ? more.value : sum.value);
    sum.live = {};
  } else {
    sum.value = graph_.make(Op::Add, masked(sum), masked(more));
    sum.live = either(sum.live, more.live);
  }
}

NodeId Sweep::masked(const Adjoint& adjoint) {
  if (adjoint.live.always()) return adjoint.value;
  const NodeId zero = graph_.constant(0);
  return adjoint.live.positive ? graph_.make(Op::Select, adjoint.live.condition, adjoint.value, zero)
                               : graph_.make(Op::Select, adjoint.live.condition, zero, adjoint.value);
}

NodeId Sweep::truth(const Activity& activity) {
  if (activity.positive) return activity.condition;
  return graph_.make(Op::Select, activity.condition, graph_.constant(0), graph_.constant(1));
}

// Both conditions; false if they exclude each other.
bool Sweep::both(const Activity& a, const Activity& b, Activity& result) {
  if (a.always() || b.always() || a == b) {
    result = a.always() ? b : a;
    return true;
  }
  if (a.condition == b.condition) return false;
  result = {graph_.make(Op::Select, truth(a), truth(b), graph_.constant(0)), true};
  return true;
}

Sweep::Activity Sweep::either(const Activity& a, const Activity& b) {
  if (a == b) return a;
  if (a.always() || b.always() || a.condition == b.condition) return {};
  return {graph_.make(Op::Select, truth(a), graph_.constant(1), truth(b)), true};
}

}  // namespace dyntape
