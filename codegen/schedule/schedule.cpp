// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/schedule/schedule.h>

#include <algorithm>
#include <bit>

#include <dyntape/codegen/schedule/few_live.h>
#include <dyntape/codegen/schedule/gather.h>

namespace dyntape::codegen {
namespace {

bool is_leaf(Op op) { return op == Op::Const || op == Op::Input; }

// Numbers grouped by node: the outputs that a node is, the results of a call, ...
class ByNode {
 public:
  ByNode(std::size_t nodes, const std::vector<NodeId>& keys) : first_(nodes + 1, 0), items_(keys.size()) {
    for (NodeId key : keys) ++first_[key + 1];
    for (std::size_t i = 0; i < nodes; ++i) first_[i + 1] += first_[i];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < keys.size(); ++i) items_[next[keys[i]]++] = static_cast<std::uint32_t>(i);
  }
  const std::uint32_t* begin(NodeId node) const { return items_.data() + first_[node]; }
  const std::uint32_t* end(NodeId node) const { return items_.data() + first_[node + 1]; }

 private:
  std::vector<std::uint32_t> first_, items_;
};

std::vector<NodeId> conditions_of(const Function& function) {
  std::vector<NodeId> conditions;
  for (const Guard& guard : function.guards) conditions.push_back(guard.condition);
  return conditions;
}

// Which groups of outputs need a node: one bit a group.  Guards belong to all groups.
std::vector<std::uint8_t> groups_of_nodes(const Function& function, const std::vector<OutputRange>& groups) {
  std::vector<std::uint8_t> mask(function.graph.size(), 0);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (std::size_t k = groups[g].begin; k < groups[g].end; ++k)
      mask[function.outputs[k]] |= static_cast<std::uint8_t>(1u << g);
  }
  for (NodeId condition : conditions_of(function))
    mask[condition] |= static_cast<std::uint8_t>((1u << groups.size()) - 1);
  for (auto id = static_cast<NodeId>(mask.size()); id-- > 0;) {
    if (mask[id]) function.graph.for_each_argument(id, [&](NodeId a) { mask[a] |= mask[id]; });
  }
  return mask;
}

bool is_result_of_long_call(const Schedule& s, const Node& node) {
  return node.op == Op::Result && s.long_call(node.a);
}

// Fills steps and sections.
class Ordering {
 public:
  Ordering(const Function& function, const std::vector<OutputRange>& groups, Functions functions,
           StatementOrder order, Schedule& schedule)
      : function_(function),
        groups_(groups),
        functions_(functions),
        order_(order),
        schedule_(schedule),
        mask_(groups_of_nodes(function, groups)),
        outputs_(function.graph.size(), function.outputs),
        checks_(function.graph.size(), conditions_of(function)),
        results_(function.graph.size(), results_by_call(function.graph, result_nodes_)) {}

  void run() {
    std::vector<std::vector<NodeId>> computed(groups_.size() + 1);  // by section, the shared one first
    for (NodeId id = 0; id < mask_.size(); ++id) {
      const Op op = function_.graph[id].op;
      if (mask_[id] && op != Op::Result && !is_leaf(op)) computed[section_of(id)].push_back(id);
    }
    for (std::size_t section = 0; section < computed.size(); ++section) {
      const std::size_t begin = schedule_.steps.size();
      add_leaf_outputs(section);
      if (order_ == StatementOrder::kFewLive)
        computed[section] = with_few_live(function_, computed[section]);
      else
        computed[section] = gather_calls(function_.graph, computed[section], functions_);
      for (NodeId id : computed[section]) add_node(id);
      const std::size_t end = schedule_.steps.size();
      if (end > begin) schedule_.sections.push_back({static_cast<int>(section) - 1, begin, end});
    }
  }

 private:
  static std::vector<NodeId> results_by_call(const Graph& graph, std::vector<NodeId>& result_nodes) {
    std::vector<NodeId> calls;
    for (NodeId id = 0; id < graph.size(); ++id) {
      if (graph[id].op != Op::Result) continue;
      result_nodes.push_back(id);
      calls.push_back(graph[id].a);
    }
    return calls;
  }

  std::size_t section_of(NodeId id) const {
    if (groups_.size() > 1 && order_ == StatementOrder::kFewLive) return 0;
    return std::has_single_bit(mask_[id]) ? static_cast<std::size_t>(std::countr_zero(mask_[id])) + 1 : 0;
  }

  // Inputs and constants that are outputs or are checked.
  void add_leaf_outputs(std::size_t section) {
    if (section == (groups_.size() > 1 ? 0 : 1)) {
      for (std::uint32_t k = 0; k < function_.guards.size(); ++k) {
        if (is_leaf(function_.graph[function_.guards[k].condition].op)) add(Step::Kind::kCheck, k);
      }
    }
    if (section == 0) return;
    for (std::size_t k = groups_[section - 1].begin; k < groups_[section - 1].end; ++k) {
      if (is_leaf(function_.graph[function_.outputs[k]].op))
        add(Step::Kind::kStore, static_cast<std::uint32_t>(k));
    }
  }

  void add_node(NodeId id) {
    add_value(id);
    if (function_.graph[id].op != Op::Call) return;
    const CallPlace* place = schedule_.long_call(id);
    for (auto r = results_.begin(id); r != results_.end(id); ++r) {
      const NodeId result = result_nodes_[*r];
      if (place && place->writes(function_.graph[result].b)) continue;
      if (mask_[result]) add_value(result);
    }
  }

  void add_value(NodeId id) {
    add(Step::Kind::kCompute, id);
    for (auto k = outputs_.begin(id); k != outputs_.end(id); ++k) add(Step::Kind::kStore, *k);
    for (auto k = checks_.begin(id); k != checks_.end(id); ++k) add(Step::Kind::kCheck, *k);
  }

  void add(Step::Kind kind, std::uint32_t index) { schedule_.steps.push_back({kind, index}); }

  const Function& function_;
  const std::vector<OutputRange>& groups_;
  const Functions functions_;
  const StatementOrder order_;
  Schedule& schedule_;
  std::vector<std::uint8_t> mask_;
  std::vector<NodeId> result_nodes_;
  ByNode outputs_, checks_, results_;
};

// Calls visit(node) for every node whose value a step reads; a long call finds what is computed in its place.
template <class Visit>
void for_each_use(const Function& function, const Schedule& s, const Step& step, Visit&& visit) {
  const Graph& graph = function.graph;
  if (step.kind == Step::Kind::kCompute) {
    if (graph[step.index].op == Op::Result) return;
    const bool is_long = s.long_call(step.index);
    graph.for_each_argument(step.index, [&](NodeId a) {
      if (!is_long || is_leaf(graph[a].op)) visit(a);
    });
  } else {
    visit(step.kind == Step::Kind::kStore ? function.outputs[step.index]
                                          : function.guards[step.index].condition);
  }
}

// Number of values that live across each cut: crossing[i] is between steps i - 1 and i.
std::vector<std::uint32_t> crossings(const Function& function, const Schedule& s) {
  constexpr std::uint32_t kNever = 0xffffffffu;
  std::vector<std::uint32_t> defined(function.graph.size(), kNever), last(function.graph.size(), 0);
  for (std::uint32_t i = 0; i < s.steps.size(); ++i) {
    for_each_use(function, s, s.steps[i], [&](NodeId a) { last[a] = i; });
    if (s.steps[i].kind == Step::Kind::kCompute) defined[s.steps[i].index] = i;
  }
  std::vector<std::uint32_t> crossing(s.steps.size() + 1, 0);  // differences first, wrapping
  for (NodeId id = 0; id < defined.size(); ++id) {
    if (defined[id] == kNever || last[id] <= defined[id]) continue;
    ++crossing[defined[id] + 1];
    --crossing[last[id] + 1];
  }
  for (std::size_t i = 1; i < crossing.size(); ++i) crossing[i] += crossing[i - 1];
  return crossing;
}

// A call and its results stay together.
std::vector<bool> cuts_that_sever_calls(const Graph& graph, const std::vector<Step>& steps) {
  std::vector<bool> severs(steps.size() + 1, false);
  for (std::size_t i = steps.size(); i-- > 0;)
    severs[i] =
        steps[i].kind == Step::Kind::kCompute ? graph[steps[i].index].op == Op::Result : severs[i + 1];
  return severs;
}

// Cuts at the place with the fewest crossings that is near enough to the wanted length.
void cut(const Function& function, std::size_t length, const std::vector<std::uint32_t>& crossing,
         Schedule& s) {
  const std::size_t n = s.steps.size();
  const std::vector<bool> severs_call = cuts_that_sever_calls(function.graph, s.steps);
  std::size_t begin = 0;
  while (n - begin > length + length / 4) {
    std::size_t best = 0;
    for (std::size_t i = begin + length * 3 / 4 + 1; i < n; ++i) {
      if (best && i > begin + length + length / 4) break;
      if (severs_call[i]) continue;
      if (!best || crossing[i] < crossing[best]) best = i;
    }
    if (!best) break;
    s.pieces.push_back({begin, best, {}, {}, {}});
    begin = best;
  }
  s.pieces.push_back({begin, n, {}, {}, {}});
}

// Finds what crosses from piece to piece, and which inputs each reads.
class Crossings {
 public:
  Crossings(const Function& function, Schedule& schedule)
      : function_(function),
        schedule_(schedule),
        slot_(function.graph.size(), 0),
        last_piece_(function.graph.size(), 0),
        seen_(function.graph.size(), 0) {}

  void run() {
    place_arguments();
    for (std::uint32_t k = 0; k < schedule_.pieces.size(); ++k) find_uses(k);
    std::vector<std::uint32_t> free;
    std::vector<std::vector<std::uint32_t>> ends(schedule_.pieces.size());  // slots free from that piece on
    for (std::uint32_t k = 0; k < schedule_.pieces.size(); ++k) {
      // A piece loads before it stores, so what it uses last makes room at once.
      free.insert(free.end(), ends[k].begin(), ends[k].end());
      assign_slots(k, free, ends);
    }
  }

 private:
  // What goes into the places of long calls.
  void place_arguments() {
    std::vector<NodeId> arguments;
    for (const CallPlace& place : schedule_.calls) {
      std::uint32_t slot = place.in;
      const std::size_t end = slot + stored_arguments(function_.graph, place.call);
      function_.graph.for_each_argument(place.call, [&](NodeId a) {
        if (slot == end) return;
        arguments.push_back(a);
        argument_slots_.push_back(slot++);
      });
    }
    arguments_ = ByNode(schedule_.calls.empty() ? 0 : function_.graph.size(), arguments);
  }

  void find_uses(std::uint32_t k) {
    Piece& piece = schedule_.pieces[k];
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
      const Step& step = schedule_.steps[i];
      for_each_use(function_, schedule_, step, [&](NodeId a) {
        if (seen_[a] == k + 1) return;
        seen_[a] = k + 1;
        last_piece_[a] = k;
        const Node& node = function_.graph[a];
        if (node.op == Op::Input) piece.inputs[node.a].push_back(node.b);
        if (!is_leaf(node.op)) piece.loads.push_back({a, 0});
      });
      if (step.kind == Step::Kind::kCompute) seen_[step.index] = k + 1, last_piece_[step.index] = k;
    }
    for (auto& indices : piece.inputs) std::sort(indices.begin(), indices.end());
  }

  void assign_slots(std::uint32_t k, std::vector<std::uint32_t>& free,
                    std::vector<std::vector<std::uint32_t>>& ends) {
    Piece& piece = schedule_.pieces[k];
    for (Crossing& load : piece.loads) load.slot = slot_[load.node];
    std::sort(piece.loads.begin(), piece.loads.end(),
              [](const Crossing& a, const Crossing& b) { return a.slot < b.slot; });
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
      const Step& step = schedule_.steps[i];
      if (step.kind != Step::Kind::kCompute) continue;
      if (!schedule_.calls.empty()) {
        for (auto n = arguments_.begin(step.index); n != arguments_.end(step.index); ++n)
          piece.stores.push_back({step.index, argument_slots_[*n]});
      }
      if (last_piece_[step.index] <= k) continue;
      const Node& node = function_.graph[step.index];
      if (is_result_of_long_call(schedule_, node)) {  // it lies in the work array already
        slot_[step.index] = schedule_.long_call(node.a)->out + node.b;
        continue;
      }
      if (free.empty()) free.push_back(static_cast<std::uint32_t>(schedule_.work++));
      slot_[step.index] = free.back();
      free.pop_back();
      ends[last_piece_[step.index]].push_back(slot_[step.index]);
      piece.stores.push_back({step.index, slot_[step.index]});
    }
    std::stable_sort(piece.stores.begin(), piece.stores.end(),
                     [](const Crossing& a, const Crossing& b) { return a.node < b.node; });
  }

  const Function& function_;
  Schedule& schedule_;
  std::vector<std::uint32_t> slot_, last_piece_, seen_;
  ByNode arguments_{0, {}};                    // of long calls
  std::vector<std::uint32_t> argument_slots_;  // of each
};

}  // namespace

const CallPlace* Schedule::long_call(NodeId id) const {
  const auto place = std::lower_bound(calls.begin(), calls.end(), id,
                                      [](const CallPlace& c, NodeId key) { return c.call < key; });
  return place != calls.end() && place->call == id ? &*place : nullptr;
}

Schedule schedule(const Function& function, const std::vector<OutputRange>& groups,
                  std::size_t piece_statements, Functions functions, StatementOrder order) {
  Schedule result;
  result.calls = place_calls(function, groups, result.work);
  Ordering(function, groups, functions, order, result).run();
  const std::vector<std::uint32_t> crossing = crossings(function, result);
  result.live = *std::max_element(crossing.begin(), crossing.end());
  cut(function, std::max<std::size_t>(piece_statements, 2), crossing, result);
  Crossings(function, result).run();
  return result;
}

}  // namespace dyntape::codegen
