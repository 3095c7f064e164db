// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive/sweep.h>

#include <algorithm>

#include <dyntape/autodiff/derive/expr.h>
#include <dyntape/autodiff/error.h>

namespace dyntape {

Sweep::Sweep(Graph& graph, Variables variables, std::size_t most)
    : graph_(graph), most_(most), flows_(graph), mark_(graph.size(), 0), next_(graph.size()) {
  find_active(variables);
}

void Sweep::check_size() const {
  if (graph_.size() - mark_.size() <= most_) return;
  throw RecordingError("derivation: the derivatives of a graph of " + std::to_string(mark_.size()) +
                       " nodes take more than " + std::to_string(most_) +
                       " further ones; derive fewer outputs at a time, or use analytic derivatives");
}

// Variables and what depends on them through a slope; and what poles make infinite, or may.
void Sweep::find_active(Variables variables) {
  active_.resize(graph_.size());
  wild_.resize(graph_.size());
  for (NodeId id = 0; id < graph_.size(); ++id) {
    const Node& node = graph_[id];
    bool active = node.op == Op::Input && node.a == static_cast<NodeId>(Block::kVariables);
    bool wild = has_pole(graph_, id) || (node.op == Op::Input && variables == Variables::kAny);
    graph_.for_each_argument(id, [&](NodeId a) { wild |= wild_[a] != 0; });
    if (node.op == Op::Call || node.op == Op::Result) {
      graph_.for_each_argument(id, [&](NodeId a) { active |= active_[a] != 0; });
    } else {
      for (int i = 0; i < info(node.op).arity; ++i)
        active |= has_slope(node.op, i) && active_[node.argument(i)];
    }
    active_[id] = active;
    wild_[id] = wild;
    if (!active || node.op != Op::Input) continue;
    variables_.resize(std::max<std::size_t>(variables_.size(), node.b + 1), kNoNode);
    variables_[node.b] = id;
  }
}

// Visits the arguments through which derivatives pass; a call takes the tangents of all.
template <class Visit>
void Sweep::for_each_way_down(NodeId id, Visit&& visit) const {
  const Node& node = graph_[id];
  if (is_table_op(node.op)) {
    for (int i = 0; i < info(node.op).arity; ++i) {
      if (has_slope(node.op, i) && active_[node.argument(i)]) visit(node.argument(i));
    }
  } else {
    graph_.for_each_argument(id, [&](NodeId a) {
      if (active_[a]) visit(a);
    });
  }
}

// And those that the node is such an argument of, as far as they lead to a root that is watched.
template <class Visit>
void Sweep::for_each_way_up(NodeId id, Visit&& visit) const {
  for (std::uint32_t k = first_user_[id]; k < first_user_[id + 1]; ++k) {
    if (watched_[users_[k]]) visit(users_[k]);
  }
}

void Sweep::find_users() {
  const auto n = static_cast<NodeId>(active_.size());
  first_user_.assign(n + 2, 0);
  for (NodeId id = 0; id < n; ++id) for_each_way_down(id, [&](NodeId a) { ++first_user_[a + 2]; });
  for (std::size_t i = 1; i < first_user_.size(); ++i) first_user_[i] += first_user_[i - 1];
  users_.resize(first_user_.back());
  for (NodeId id = 0; id < n; ++id)
    for_each_way_down(id, [&](NodeId a) { users_[first_user_[a + 1]++] = id; });
  watched_.assign(n, 0);
}

void Sweep::watch(NodeId root) {
  if (first_user_.empty()) find_users();
  std::vector<NodeId> stack = {root};
  while (!stack.empty()) {
    const NodeId id = stack.back();
    stack.pop_back();
    if (watched_[id]++ == 0) for_each_way_down(id, [&](NodeId a) { stack.push_back(a); });
  }
}

void Sweep::unwatch(NodeId root) {
  std::vector<NodeId> stack = {root};
  while (!stack.empty()) {
    const NodeId id = stack.back();
    stack.pop_back();
    if (--watched_[id] == 0) for_each_way_down(id, [&](NodeId a) { stack.push_back(a); });
  }
}

std::vector<NodeId> Sweep::cone(const std::vector<NodeId>& roots) {
  ++epoch_;
  std::vector<NodeId> ids, stack;
  const auto push = [&](NodeId id) {
    if (mark(id)) stack.push_back(id);
  };
  for (NodeId root : roots) push(root);
  while (!stack.empty()) {
    const NodeId id = stack.back();
    stack.pop_back();
    ids.push_back(id);
    for_each_way_down(id, push);
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

std::size_t Sweep::count_reverse(NodeId root, std::size_t most) {
  ++epoch_;
  std::vector<NodeId> met = {root};
  mark(root);
  for (std::size_t i = 0; i < met.size() && met.size() < most; ++i)
    for_each_way_down(met[i], [&](NodeId a) {
      if (mark(a)) met.push_back(a);
    });
  return std::min(met.size(), most);
}

std::size_t Sweep::count_forward(std::uint32_t variable, std::size_t most) {
  ++epoch_;
  std::vector<NodeId> met = {variables_[variable]};
  mark(met[0]);
  for (std::size_t i = 0; i < met.size() && met.size() < most; ++i)
    for_each_way_up(met[i], [&](NodeId user) {
      if (mark(user)) met.push_back(user);
    });
  return std::min(met.size(), most);
}

// Whether the slope of a node in an argument, a number: at a pole, or because of what it is made of.  In x * y the
// slope in x is y, whatever x is.
bool Sweep::may_be_infinite(NodeId id, int argument) const {
  const Node& node = graph_[id];
  const ops::SlopeCell& slope = ops::slope_cell(node.op, argument);
  if (!wild_[id] || !slope.scales) return false;
  if (has_pole(graph_, id)) return true;
  const auto is_made_of = [&](int i) { return ((slope.mentions >> i) & 1u) != 0; };
  for (int i = 0; i < info(node.op).arity; ++i) {
    if (is_made_of(i) && wild_[node.argument(i)]) return true;
  }
  return is_made_of(3);
}

// What becomes of a flow on its way through an argument of a node.
Flow Sweep::passed(NodeId id, int argument, Flow flow) {
  const Node node = graph_[id];
  switch (node.op) {  // most nodes are of these: their cells of the table, without the way through Expr
    case Op::Add:
      return flow;
    case Op::Sub:
      if (argument == 1) flow.value = graph_.make(Op::Neg, flow.value);
      return flow;
    case Op::Mul:
      flow.value = graph_.make(Op::Mul, flow.value, argument == 0 ? node.b : node.a);
      flow.wild = flow.wild || (wild_[id] && may_be_infinite(id, argument));
      return flow;
    default:
      break;
  }
  const Expr out =
      slope<Expr>(node.op, argument, Expr(node.a), Expr(node.b), Expr(node.c), Expr(id), Expr(flow.value));
  flow.value = out.id;
  if (node.op == Op::Gate) return flows_.through_gate(flow, node.a);
  if (out.condition != kNoNode) return flows_.through_branch(flow, out.condition, out.positive);
  flow.wild = flow.wild || may_be_infinite(id, argument);
  return flow;
}

Flow Sweep::started(const Seed& seed) {
  Flow flow{seed.value};
  if (seed.alive != kNoNode) flow.weighted = flows_.conditions().is(seed.alive);
  return flow;
}

// --- calls ---

// What the flows are to the derivative of a call that can be told: as they come, while there are few ways of that;
// else all as weights, which serves them all with one more callee.
Seeds Sweep::kinds_of(const std::vector<Flow>& flows, const Callee& callee) {
  constexpr std::size_t kMostWays = 8;
  Seeds kinds;
  for (const Flow& flow : flows) {
    const bool is_weight = flow.live != kAlways || flow.weighted != kAlways;
    kinds.push_back(!flow.exists() ? SeedKind::kNone : is_weight ? SeedKind::kWeight : SeedKind::kNumber);
  }
  const auto is_number = [](SeedKind kind) { return kind == SeedKind::kNumber; };
  if (callee.dissolves() || std::all_of(kinds.begin(), kinds.end(), is_number)) return kinds;
  std::set<Seeds>& ways = ways_called_[&callee];
  if (ways.size() < kMostWays) ways.insert(kinds);
  return ways.count(kinds) ? kinds : Seeds(flows.size(), SeedKind::kWeight);
}

// The arguments of the call and the seeds of its derivative.  A seed that is not there, or not alive, meets no
// pole inside, if the callee can be told.
Sweep::CallSeeds Sweep::call_seeds(NodeId id, const std::vector<Flow>& flows) {
  const Callee& callee = *graph_.callees()[graph_[id].a];
  const bool tells = wild_[id] && derivatives_follow(callee);
  CallSeeds seeds;
  seeds.kinds = tells ? kinds_of(flows, callee) : Seeds(flows.size(), SeedKind::kNumber);
  std::vector<NodeId> alive;
  graph_.for_each_argument(id, [&](NodeId a) { seeds.arguments.push_back(a); });
  for (std::size_t i = 0; i < flows.size(); ++i) {
    if (seeds.kinds[i] == SeedKind::kNone) continue;
    const bool exists = flows[i].exists();
    seeds.arguments.push_back(exists ? flows_.value_of(flows[i]) : graph_.constant(0));
    if (seeds.kinds[i] == SeedKind::kWeight)
      alive.push_back(exists ? flows_.alive(flows[i]) : graph_.constant(0));
  }
  seeds.arguments.insert(seeds.arguments.end(), alive.begin(), alive.end());
  return seeds;
}

// What comes out of the derivative of a call into which `flows` went: each result carries the conditions of those
// that it depends on.
std::vector<Flow> Sweep::call_results(NodeId id, const std::vector<NodeId>& values,
                                      const std::vector<Flow>& flows, bool transposed) {
  const Callee& callee = *graph_.callees()[graph_[id].a];
  std::vector<Flow> results(values.size());
  const auto reach = [&](Flow& result, const Flow& flow) {
    if (!flow.exists()) return;
    if (result.exists()) return flows_.unite(result, flow);
    result = {flow.value, flow.live, flow.weighted};
  };
  const Pattern& pattern = callee.pattern;
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    transposed ? reach(results[pattern.col[k]], flows[pattern.row[k]])
               : reach(results[pattern.row[k]], flows[pattern.col[k]]);
  }
  if (pattern.rows == 0) {  // all on all
    Flow any;
    for (const Flow& flow : flows) reach(any, flow);
    std::fill(results.begin(), results.end(), any);
  }
  const bool is_wild = wild_[id];
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].exists()) results[i].value = values[i];
    results[i].wild = is_wild;
  }
  return results;
}

// --- forward ---

std::vector<NodeId> Sweep::forward(const std::vector<NodeId>& roots,
                                   const std::function<Seed(std::uint32_t)>& seed) {
  const GraphScope scope(graph_);
  tangent_.resize(mark_.size());
  const std::vector<NodeId> ids = cone(roots);
  for (NodeId id : ids) {
    if (active_[id]) tangent_[id] = tangent_of(id, seed);
  }
  return tangents_of(roots, ids);
}

// From the variable upwards, in the order of the graph: whatever has no tangent ends the way.
std::vector<NodeId> Sweep::forward(const std::vector<NodeId>& roots, std::uint32_t variable) {
  const GraphScope scope(graph_);
  tangent_.resize(mark_.size());
  const NodeId one = graph_.constant(1);
  const auto seed = [&](std::uint32_t) { return Seed(one); };
  next_.push(variables_[variable]);
  std::vector<NodeId> visited;
  while (!next_.empty()) {
    const NodeId id = next_.pop();
    visited.push_back(id);
    tangent_[id] = tangent_of(id, seed);
    if (!tangent_[id].exists() && graph_[id].op != Op::Call) continue;
    for_each_way_up(id, [&](NodeId user) { next_.push(user); });
  }
  return tangents_of(roots, visited);
}

// Reads them, and leaves nothing behind for the next sweep.
std::vector<NodeId> Sweep::tangents_of(const std::vector<NodeId>& roots, const std::vector<NodeId>& visited) {
  check_size();
  std::vector<NodeId> result;
  for (NodeId root : roots) {
    const Flow& tangent = tangent_[root];
    result.push_back(tangent.exists() ? flows_.value_of(tangent) : kNoNode);
  }
  for (NodeId id : visited) {
    tangent_[id] = {};
    if (graph_[id].op == Op::Call && graph_[id].c < call_tangents_.size())
      call_tangents_[graph_[id].c].clear();
  }
  return result;
}

Flow Sweep::tangent_of(NodeId id, const std::function<Seed(std::uint32_t)>& seed) {
  const Node node = graph_[id];
  switch (node.op) {
    case Op::Const:
      return {};
    case Op::Input:
      return node.a == static_cast<NodeId>(Block::kVariables) ? started(seed(node.b)) : Flow{};
    case Op::Call:
      forward_call(id);
      return {};
    case Op::Result: {
      const auto& tangents = call_tangents_[graph_[node.a].c];
      return tangents.empty() ? Flow{} : tangents[node.b];
    }
    default:
      break;
  }
  // dr = sum over arguments of slope_i(d argument_i)
  Flow sum;
  for (int i = 0; i < info(node.op).arity; ++i) {
    const Flow& tangent = tangent_[node.argument(i)];
    if (tangent.exists() && has_slope(node.op, i)) flows_.add(sum, passed(id, i, tangent));
  }
  // A tangent that came out as the constant 0 is as good as none.
  if (!sum.exists() || graph_.is_constant(sum.value, 0)) return {};
  return sum.cut ? flows_.masked(sum) : sum;  // once, whoever uses it
}

void Sweep::forward_call(NodeId id) {
  const Node call = graph_[id];
  const std::shared_ptr<const Callee> callee = graph_.callees()[call.a];
  call_tangents_.resize(std::max<std::size_t>(call_tangents_.size(), call.c + 1));
  std::vector<Flow> flows;
  graph_.for_each_argument(id, [&](NodeId a) { flows.push_back(tangent_[a]); });
  if (std::none_of(flows.begin(), flows.end(), [](const Flow& flow) { return flow.exists(); })) return;
  const CallSeeds seeds = call_seeds(id, flows);
  const std::vector<NodeId> values = graph_.call(jvp_callee(callee, seeds.kinds), seeds.arguments);
  call_tangents_[call.c] = call_results(id, values, flows, false);
}

// --- reverse ---

std::vector<std::pair<std::uint32_t, NodeId>> Sweep::reverse(const std::vector<NodeId>& roots,
                                                             const std::vector<Seed>& seeds) {
  const GraphScope scope(graph_);
  adjoint_.resize(mark_.size());
  const std::vector<NodeId> ids = cone(roots);
  for (std::size_t i = 0; i < roots.size(); ++i) {
    if (seeds[i].value != kNoNode && active_[roots[i]]) flows_.add(adjoint_[roots[i]], started(seeds[i]));
  }
  std::vector<std::pair<std::uint32_t, NodeId>> result;
  for (auto it = ids.rbegin(); it != ids.rend(); ++it) {
    const NodeId id = *it;
    const Flow adjoint = std::exchange(adjoint_[id], {});
    const Node node = graph_[id];
    if (node.op == Op::Call) {
      reverse_call(id);
    } else if (!adjoint.exists()) {
      continue;
    } else if (node.op == Op::Input) {
      const NodeId value = flows_.value_of(adjoint);
      if (!graph_.is_constant(value, 0)) result.emplace_back(node.b, value);
    } else {
      push_adjoint(id, adjoint);
    }
  }
  check_size();
  std::sort(result.begin(), result.end());
  return result;
}

void Sweep::push_adjoint(NodeId id, const Flow& adjoint) {
  const Node node = graph_[id];
  if (node.op == Op::Result) {
    const Node call = graph_[node.a];
    call_adjoints_.resize(std::max<std::size_t>(call_adjoints_.size(), call.c + 1));
    std::vector<Flow>& collected = call_adjoints_[call.c];
    collected.resize(graph_.callees()[call.a]->n_out);
    collected[node.b] = adjoint;
    return;
  }
  for (int i = 0; i < info(node.op).arity; ++i) {
    const NodeId argument = node.argument(i);
    if (active_[argument] && has_slope(node.op, i)) flows_.add(adjoint_[argument], passed(id, i, adjoint));
  }
}

void Sweep::reverse_call(NodeId id) {
  const Node call = graph_[id];
  if (call.c >= call_adjoints_.size() || call_adjoints_[call.c].empty()) return;
  const std::vector<Flow> flows = std::exchange(call_adjoints_[call.c], {});
  const std::shared_ptr<const Callee> callee = graph_.callees()[call.a];
  const CallSeeds seeds = call_seeds(id, flows);
  const std::vector<NodeId> values = graph_.call(vjp_callee(callee, seeds.kinds), seeds.arguments);
  const std::vector<Flow> results = call_results(id, values, flows, true);
  for (std::size_t i = 0; i < results.size(); ++i) {
    const NodeId argument = seeds.arguments[i];
    if (results[i].exists() && active_[argument]) flows_.add(adjoint_[argument], results[i]);
  }
}

}  // namespace dyntape
