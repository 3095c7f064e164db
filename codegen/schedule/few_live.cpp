// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/schedule/few_live.h>

#include <algorithm>
#include <limits>
#include <queue>
#include <unordered_map>

#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape::codegen {
namespace {

using Index = std::uint32_t;
constexpr Index kNoUnit = std::numeric_limits<Index>::max();
// Of the values that are live in the recorded order; the compilers of cards move statements, and with a small gain
// the recorded order needs fewer registers (docs/how_to/gpu.md).
constexpr double kFewer = 0.85;

// What is computed together: a node, sine and cosine of one argument, a call with its results, the load of an input.
struct LiveUnit {
  std::vector<NodeId> nodes;              // in the order in which they are printed; none of an input
  std::vector<NodeId> values, arguments;  // each once; without constants
  std::vector<Index> before;              // units whose values it uses
  Index after = 0;                        // how many use its own
  Index last = kNoUnit;                   // the last of these
};

class LiveUnits {
 public:
  LiveUnits(const Function& function, const std::vector<NodeId>& order)
      : users(function.graph.size()), graph_(function.graph), unit_(function.graph.size(), kNoUnit) {
    std::unordered_map<NodeId, Index> turns;  // by argument
    for (const NodeId id : order) {
      const Node& node = graph_[id];
      Index unit = static_cast<Index>(all.size());
      if (is_turn(node.op) && graph_[node.a].op != Op::Const)
        unit = turns.emplace(node.a, unit).first->second;
      if (unit == all.size()) all.emplace_back();
      all[unit].nodes.push_back(id);
      define(unit, id);
    }
    for (NodeId id = 0; id < graph_.size(); ++id) {
      const Node& node = graph_[id];
      if (node.op == Op::Result && unit_[node.a] != kNoUnit) define(unit_[node.a], id);
      if (node.op != Op::Input) continue;
      all.emplace_back();
      define(static_cast<Index>(all.size() - 1), id);
    }
    for (Index unit = 0; unit < all.size(); ++unit) {
      for (const NodeId id : all[unit].nodes) graph_.for_each_argument(id, [&](NodeId a) { use(unit, a); });
    }
    for (const NodeId output : function.outputs) {
      if (unit_[output] != kNoUnit) outputs.push_back(output);
    }
  }

  std::vector<LiveUnit> all;
  std::vector<std::vector<Index>> users;  // by value
  std::vector<NodeId> outputs;            // without constants

 private:
  void define(Index unit, NodeId id) {
    unit_[id] = unit;
    all[unit].values.push_back(id);
  }

  void use(Index unit, NodeId a) {
    if (unit_[a] == kNoUnit) return;  // a constant
    if (!users[a].empty() && users[a].back() == unit) return;
    users[a].push_back(unit);
    all[unit].arguments.push_back(a);
    LiveUnit& from = all[unit_[a]];
    if (from.last == unit) return;
    from.last = unit;
    ++from.after;
    all[unit].before.push_back(unit_[a]);
  }

  const Graph& graph_;
  std::vector<Index> unit_;  // that computes a node
};

enum class Among { kOldest, kLastRecorded };

class Backwards {
 public:
  Backwards(const LiveUnits& units, std::size_t nodes, Among among)
      : units_(units.all), users_(units.users), among_(among), live_(nodes, false), state_(units_.size()) {
    for (const NodeId output : units.outputs) live_[output] = true;
    for (const LiveUnit& unit : units_) waiting_.push_back(unit.after);
  }

  std::vector<NodeId> run() {
    std::vector<NodeId> order;
    for (Index u = 0; u < units_.size(); ++u) {
      if (waiting_[u] == 0) enter(u);
    }
    while (!ready_.empty()) {
      const Entry entry = ready_.top();
      ready_.pop();
      State& state = state_[entry.unit];
      if (!state.is_ready || entry.cost != state.cost) continue;  // it has changed since, or is taken
      state.is_ready = false;
      ++time_;
      const LiveUnit& unit = units_[entry.unit];
      order.insert(order.end(), unit.nodes.rbegin(), unit.nodes.rend());
      for (const NodeId value : unit.values) live_[value] = false;
      for (const NodeId a : unit.arguments) make_live(a);
      for (const Index before : unit.before) {
        if (--waiting_[before] == 0) enter(before);
      }
    }
    std::reverse(order.begin(), order.end());
    return order;
  }

 private:
  struct State {
    bool is_ready = false;
    int cost = 0;
    Index since = 0;
  };
  struct Entry {
    int cost;
    Index since, unit;
    bool operator<(const Entry& other) const {  // of two the better is greater
      if (cost != other.cost) return cost > other.cost;
      return since != other.since ? since > other.since : unit < other.unit;
    }
  };

  void enter(Index u) {
    State& state = state_[u];
    state.is_ready = true;
    state.since = among_ == Among::kOldest ? time_ : 0;
    state.cost = 0;
    for (const NodeId a : units_[u].arguments) state.cost += !live_[a];
    for (const NodeId value : units_[u].values) state.cost -= live_[value];
    ready_.push({state.cost, state.since, u});
  }

  void make_live(NodeId a) {
    if (live_[a]) return;
    live_[a] = true;
    for (const Index u : users_[a]) {
      if (!state_[u].is_ready) continue;
      --state_[u].cost;
      ready_.push({state_[u].cost, state_[u].since, u});
    }
  }

  const std::vector<LiveUnit>& units_;
  const std::vector<std::vector<Index>>& users_;
  const Among among_;
  std::vector<bool> live_;
  std::vector<Index> waiting_;  // for so many units that use it
  std::vector<State> state_;
  std::priority_queue<Entry> ready_;
  Index time_ = 0;
};

}  // namespace

std::size_t most_live(const Function& function, const std::vector<NodeId>& order) {
  const LiveUnits units(function, order);
  std::vector<Index> unit_of(function.graph.size(), kNoUnit), left(function.graph.size(), 0);
  std::vector<bool> is_taken(units.all.size(), false);
  for (Index u = 0; u < units.all.size(); ++u) {
    for (const NodeId id : units.all[u].nodes) unit_of[id] = u;
    for (const NodeId value : units.all[u].values)
      left[value] = static_cast<Index>(units.users[value].size());
  }
  std::size_t live = 0, most = 0;
  std::vector<bool> is_live(function.graph.size(), false);
  const auto begin = [&](NodeId value) {
    if (is_live[value] || left[value] == 0) return;
    is_live[value] = true;
    most = std::max(most, ++live);
  };
  for (const NodeId id : order) {
    const Index u = unit_of[id];
    if (is_taken[u]) continue;  // the second of sine and cosine
    is_taken[u] = true;
    for (const NodeId a : units.all[u].arguments) begin(a);  // an input
    for (const NodeId a : units.all[u].arguments) live -= --left[a] == 0;
    for (const NodeId value : units.all[u].values) begin(value);
  }
  return most;
}

std::vector<NodeId> with_few_live(const Function& function, const std::vector<NodeId>& order) {
  const LiveUnits units(function, order);
  std::vector<NodeId> best;
  std::size_t least = order.size() + function.graph.size();
  for (const Among among : {Among::kOldest, Among::kLastRecorded}) {
    std::vector<NodeId> other = Backwards(units, function.graph.size(), among).run();
    const std::size_t most = most_live(function, other);
    if (most < least) least = most, best = std::move(other);
  }
  return double(least) < kFewer * double(most_live(function, order)) ? best : order;
}

}  // namespace dyntape::codegen
