// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/schedule/gather.h>

#include <algorithm>
#include <map>
#include <utility>

namespace dyntape::codegen {
namespace {

constexpr std::uint32_t kNoTeam = 0xffffffffu;

class Gathering {
 public:
  Gathering(const Graph& graph, const std::vector<NodeId>& order, Functions functions)
      : graph_(graph),
        order_(order),
        functions_(functions),
        waits_(graph.size(), false),
        team_of_(graph.size(), kNoTeam) {}

  std::vector<NodeId> run() {
    make_teams();
    if (teams_.empty()) return order_;
    for (NodeId id : order_) waits_[id] = true;
    for (NodeId id : order_) add(id);
    return std::move(result_);
  }

 private:
  // How many gathered calls, one behind the other, a value depends on.
  std::vector<std::uint32_t> depths() const {
    std::vector<std::uint32_t> depth(graph_.size(), 0);
    for (NodeId id = 0; id < graph_.size(); ++id)
      graph_.for_each_argument(id, [&](NodeId a) {
        depth[id] = std::max(depth[id], depth[a] + (is_gathered(graph_, a, functions_) ? 1u : 0u));
      });
    return depth;
  }

  // A team takes the calls of its values, whenever they come, and values until there are eight.
  void make_teams() {
    const std::vector<std::uint32_t> depth = depths();
    struct Open {
      std::uint32_t team = kNoTeam;
      std::size_t values = 0;
    };
    std::map<std::pair<Op, std::uint32_t>, Open> open;  // by function and depth
    std::map<std::pair<Op, NodeId>, std::uint32_t> team_of_value;
    for (NodeId id : order_) {
      if (!is_gathered(graph_, id, functions_)) continue;
      const Op op = team_operator(graph_[id].op);
      const auto [known, is_new] = team_of_value.emplace(std::pair(op, graph_[id].a), kNoTeam);
      if (is_new) {
        Open& last = open[{op, depth[id]}];
        if (last.team == kNoTeam || last.values == kGathered) {
          last = {static_cast<std::uint32_t>(teams_.size()), 0};
          teams_.emplace_back();
        }
        ++last.values;
        known->second = last.team;
      }
      team_of_[id] = known->second;
      teams_[known->second].push_back(id);
    }
  }

  // What `id` reads comes first: a stack of what is begun, as chains may be long.
  void add(NodeId id) {
    std::vector<NodeId> begun = {id};
    while (!begun.empty()) {
      const NodeId next = begun.back();
      if (!waits_[next]) {
        begun.pop_back();
        continue;
      }
      const std::size_t before = begun.size();
      for_each_member(next, [&](NodeId member) {
        graph_.for_each_argument(member, [&](NodeId a) {
          const NodeId needed = graph_[a].op == Op::Result ? graph_[a].a : a;
          if (waits_[needed]) begun.push_back(needed);
        });
      });
      if (begun.size() > before) continue;
      for_each_member(next, [&](NodeId member) {
        result_.push_back(member);
        waits_[member] = false;
      });
    }
  }

  template <class Visit>
  void for_each_member(NodeId id, Visit&& visit) const {
    if (team_of_[id] == kNoTeam) return visit(id);
    for (NodeId member : teams_[team_of_[id]]) visit(member);
  }

  const Graph& graph_;
  const std::vector<NodeId>& order_;
  const Functions functions_;
  std::vector<bool> waits_;
  std::vector<std::uint32_t> team_of_;
  std::vector<std::vector<NodeId>> teams_;
  std::vector<NodeId> result_;
};

}  // namespace

bool is_gathered(const Graph& graph, NodeId id, Functions functions) {
  const Node& node = graph[id];
  return is_table_op(node.op) && is_portable(node.op, functions) && info(node.op).arity == 1 &&
         graph[node.a].op != Op::Const;
}

std::vector<NodeId> gather_calls(const Graph& graph, const std::vector<NodeId>& order, Functions functions) {
  return Gathering(graph, order, functions).run();
}

}  // namespace dyntape::codegen
