// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/passes/repeats.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace dyntape::codegen {
namespace {

using Tuple = std::vector<NodeId>;  // a node of each part

constexpr std::size_t kMostParts = 8;

// In its first two arguments.
bool commutes(Op op) { return (info(op).laws & kCommutative) != 0; }

std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
  a ^= b + 0x9e3779b97f4a7c15u + (a << 6) + (a >> 2);
  a = (a ^ (a >> 30)) * 0xbf58476d1ce4e5b9u;
  return a ^ (a >> 27);
}

// Of an operation whose arguments have these keys.
template <class KeyOf>
std::uint64_t key_of(const Node& node, KeyOf&& key_of_argument) {
  std::array<std::uint64_t, 3> keys{};
  const int arity = info(node.op).arity;
  for (int i = 0; i < arity; ++i) keys[static_cast<std::size_t>(i)] = key_of_argument(node.argument(i));
  if (commutes(node.op)) std::sort(keys.begin(), keys.begin() + 2);
  std::uint64_t key = static_cast<std::uint64_t>(node.op) + 1000;
  for (int i = 0; i < arity; ++i) key = mixed(key, keys[static_cast<std::size_t>(i)]);
  return key;
}

// A node and what it is sorted by.  The two lie side by side because a million of them are sorted from end to end of
// the memory, where a key looked up by node would be anywhere.
struct Keyed {
  std::uint64_t key;
  NodeId id;
};

// Equal keys come to lie together, in the order of the nodes.
void sort_by_key(std::vector<Keyed>& nodes) {
  std::sort(nodes.begin(), nodes.end(),
            [](const Keyed& a, const Keyed& b) { return a.key != b.key ? a.key < b.key : a.id < b.id; });
}

// Shape and height of every node, and the nodes of each shape.
struct Shapes {
  explicit Shapes(const Graph& graph) : shape(graph.size()), height(graph.size(), 0) {
    std::vector<Keyed> operations;
    for (NodeId id = 0; id < graph.size(); ++id) {
      const Node& node = graph[id];
      shape[id] = node.op == Op::Const ? 1 : node.op == Op::Input ? 2 : mixed(3, id);
      if (!is_operation(node)) continue;
      shape[id] = key_of(node, [&](NodeId a) { return shape[a]; });
      graph.for_each_argument(id, [&](NodeId a) { height[id] = std::max(height[id], height[a] + 1); });
      operations.push_back({shape[id], id});
    }
    find_alike(operations);
  }

  void find_alike(std::vector<Keyed>& operations) {
    sort_by_key(operations);
    for (std::size_t i = 0, end = 0; i < operations.size(); i = end) {
      while (end < operations.size() && operations[end].key == operations[i].key) ++end;
      if (end - i < 2 || end - i > kMostParts) continue;
      Tuple& nodes = alike.emplace_back();
      for (std::size_t k = i; k < end; ++k) nodes.push_back(operations[k].id);
    }
    std::stable_sort(alike.begin(), alike.end(),
                     [&](const Tuple& a, const Tuple& b) { return height[a[0]] > height[b[0]]; });
  }

  std::vector<std::uint64_t> shape;
  std::vector<std::uint32_t> height;
  std::vector<Tuple> alike;  // the highest first
};

// The number of parts that would save most.
std::size_t likely_count(const std::vector<Tuple>& alike) {
  std::array<std::size_t, kMostParts + 1> saved{};
  for (const Tuple& nodes : alike) saved[nodes.size()] += nodes.size() - 1;
  return static_cast<std::size_t>(std::max_element(saved.begin(), saved.end()) - saved.begin());
}

// Finds inputs that correspond.
class Walks {
 public:
  Walks(const Graph& graph, const Shapes& shapes, std::size_t count)
      : graph_(graph),
        shapes_(shapes),
        count_(count),
        budget_(32 * graph.size()),
        walk_of_(graph.size(), kNone) {
    place_.resize(graph.size());
    for (const Tuple& roots : shapes.alike) {
      if (roots.size() == count && walk_of_[roots[0]] == kNone) walk(roots);
    }
  }

  // Inputs that the same walks lead to, those of most inputs first.
  std::vector<std::vector<Tuple>> groups() {
    std::map<std::uint32_t, std::vector<Tuple>> by_walk;
    for (const auto& [tuple, walk] : inputs_) by_walk[top(walk)].push_back(tuple);
    std::vector<std::vector<Tuple>> groups;
    for (auto& [walk, tuples] : by_walk) groups.push_back(std::move(tuples));
    std::stable_sort(groups.begin(), groups.end(),
                     [](const auto& a, const auto& b) { return a.size() > b.size(); });
    return groups;
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  void forget_met() {
    for (const Tuple& t : met_) {
      for (NodeId id : t) walk_of_[id] = kNone;
    }
  }

  void walk(const Tuple& roots) {
    const auto number = static_cast<std::uint32_t>(same_.size());
    order_.clear(), touched_.clear(), met_.clear();
    std::vector<Tuple> stack = {roots};
    while (!stack.empty()) {
      const Tuple tuple = std::move(stack.back());
      stack.pop_back();
      if (budget_ == 0 || !step(tuple, stack)) return forget_met();
      --budget_;
    }
    same_.push_back(number);
    for (std::uint32_t other : touched_) same_[top(other)] = number;
    for (const Tuple& t : met_) put_in_order(t, number);
  }

  void put_in_order(const Tuple& t, std::uint32_t number) {
    Tuple in_order(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t part = order_.empty() ? i : order_[i];
      in_order[part] = t[i];
      place_[t[i]].second = static_cast<std::uint32_t>(part);
    }
    for (NodeId id : in_order) walk_of_[id] = number, place_[id].first = in_order[0];
    if (graph_[in_order[0]].op == Op::Input) inputs_.emplace_back(std::move(in_order), number);
  }

  // Whether the nodes correspond as far as this; their arguments are put on the stack.
  bool step(const Tuple& tuple, std::vector<Tuple>& stack) {
    Tuple sorted = tuple;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
      return true;  // it is none of a part
    const Node& first = graph_[tuple[0]];
    if (first.op == Op::Const) return true;
    const auto is_met = [&](NodeId id) { return walk_of_[id] == kThis; };
    if (std::any_of(tuple.begin(), tuple.end(), is_met)) return is_in_place(tuple);
    if (std::any_of(tuple.begin(), tuple.end(),
                    [&](NodeId id) { return shapes_.shape[id] != shapes_.shape[tuple[0]]; }))
      return false;
    if (std::any_of(tuple.begin(), tuple.end(), [&](NodeId id) { return walk_of_[id] != kNone; }))
      return agrees(tuple);
    for (std::size_t i = 0; i < count_; ++i) {
      walk_of_[tuple[i]] = kThis;
      place_[tuple[i]] = {tuple[0], static_cast<std::uint32_t>(i)};
    }
    met_.push_back(tuple);
    if (!is_operation(first)) return true;
    const int arity = info(first.op).arity;
    std::vector<Tuple> arguments(static_cast<std::size_t>(arity), Tuple(count_));
    for (std::size_t i = 0; i < count_; ++i) {
      const Node& node = graph_[tuple[i]];
      const bool swaps = commutes(first.op) && swapped(first, node);
      for (int k = 0; k < arity; ++k)
        arguments[static_cast<std::size_t>(k)][i] = node.argument(swaps && k < 2 ? 1 - k : k);
    }
    for (Tuple& t : arguments) stack.push_back(std::move(t));
    return true;
  }

  // Whether this walk has met all of them in one step, each for the same part.
  bool is_in_place(const Tuple& tuple) const {
    for (std::size_t i = 0; i < count_; ++i) {
      const auto& [first, part] = place_[tuple[i]];
      if (walk_of_[tuple[i]] != kThis || part != i || first != place_[tuple[0]].first) return false;
    }
    return true;
  }

  // An earlier walk has met all of them in one step; the order of the parts is then that one's.
  bool agrees(const Tuple& tuple) {
    std::vector<std::size_t> order(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const NodeId id = tuple[i];
      if (walk_of_[id] >= kThis || place_[id].first != place_[tuple[0]].first) return false;
      order[i] = place_[id].second;
    }
    if (order_.empty()) order_ = order;
    touched_.push_back(walk_of_[tuple[0]]);
    return order_ == order;
  }

  bool swapped(const Node& first, const Node& node) const {
    if (node.a == first.a || node.b == first.b) return false;
    if (node.a == first.b || node.b == first.a) return true;
    const auto shape = [&](NodeId id) { return shapes_.shape[id]; };
    return shape(node.a) != shape(first.a) || shape(node.b) != shape(first.b);
  }

  std::uint32_t top(std::uint32_t walk) {
    while (same_[walk] != walk) walk = same_[walk] = same_[same_[walk]];
    return walk;
  }

  static constexpr std::uint32_t kThis = kNone - 1;

  const Graph& graph_;
  const Shapes& shapes_;
  std::size_t count_, budget_;
  std::vector<std::uint32_t> walk_of_;                   // by node
  std::vector<std::pair<NodeId, std::uint32_t>> place_;  // first node of its tuple, and its part
  std::vector<std::pair<Tuple, std::uint32_t>> inputs_;  // and the walk
  std::vector<std::uint32_t> same_;                      // walks that belong together: a forest
  // Of the walk under way.
  std::vector<std::size_t> order_;
  std::vector<std::uint32_t> touched_;
  std::vector<Tuple> met_;
};

// Follows the parts upwards from their inputs.
class Parts {
 public:
  Parts(const Graph& graph, std::size_t count, const std::vector<Tuple>& inputs)
      : graph_(graph),
        count_(count),
        part_(graph.size(), kNoPart),
        key_(graph.size()),
        apart_(graph.size(), false) {
    for (std::size_t t = 0; t < inputs.size(); ++t) {
      for (std::size_t i = 0; i < count; ++i) {
        part_[inputs[t][i]] = static_cast<int>(i);
        key_[inputs[t][i]] = mixed(4, t);
      }
    }
    // Nodes without counterpart stay apart, and what is made of them has none either.
    for (int round = 0; round < 16; ++round) {
      follow();
      if (is_complete(round < 6)) return;
    }
    tuples_.clear();
  }

  std::size_t size() const { return tuples_.size(); }

  Repeats repeats() const {
    Repeats repeats{count_, tuples_};
    std::sort(repeats.nodes.begin(), repeats.nodes.end());
    return repeats;
  }

 private:
  static constexpr int kNoPart = -1;
  void follow() {
    found_.clear(), alike_.clear(), kinds_.clear();
    for (NodeId id = 0; id < graph_.size(); ++id) {
      const Node& node = graph_[id];
      if (!is_operation(node)) continue;
      part_[id] = apart_[id] ? kNoPart : part_of(node);
      if (part_[id] == kNoPart) continue;
      const std::uint64_t key = key_of(node, [&](NodeId a) {
        return part_[a] != kNoPart         ? key_[a]
               : graph_[a].op == Op::Const ? std::uint64_t{1}
                                           : std::uint64_t{2};
      });
      key_[id] = mixed(
          key, is_inside(node) ? 1 : number_among_alike(mixed(key, static_cast<std::uint64_t>(part_[id]))));
      found_.push_back({key_[id], id});
    }
    sort_by_key(found_);
  }

  // Whether its arguments all belong to the part: no other node then has the same operator and arguments.
  bool is_inside(const Node& node) const {
    for (int i = 0; i < info(node.op).arity; ++i) {
      if (part_[node.argument(i)] == kNoPart) return false;
    }
    return true;
  }

  // 1, 2, ... for nodes of one operator and one part whose arguments are the same or of no part.
  std::uint32_t number_among_alike(std::uint64_t key) {
    const NodeId kind = alike_.find_or_add(key, static_cast<NodeId>(kinds_.size()),
                                           [&](NodeId other) { return kinds_[other].key == key; });
    if (kind == kinds_.size()) kinds_.push_back({key, 0});
    return ++kinds_[kind].count;
  }

  int part_of(const Node& node) const {
    int part = kNoPart;
    for (int i = 0; i < info(node.op).arity; ++i) {
      const int other = part_[node.argument(i)];
      if (other == kNoPart) continue;
      if (part != kNoPart && part != other) return kNoPart;
      part = other;
    }
    return part;
  }

  // Nodes that have all their counterparts become tuples; true: of the others.
  std::vector<bool> collect_tuples() {
    tuples_.clear();
    std::vector<bool> lacks(graph_.size(), false);
    for (std::size_t i = 0, end = 0; i < found_.size(); i = end) {
      while (end < found_.size() && found_[end].key == found_[i].key) ++end;
      if (end - i == count_) {
        Tuple tuple(count_);
        for (std::size_t k = i; k < end; ++k)
          tuple[static_cast<std::size_t>(part_[found_[k].id])] = found_[k].id;
        tuples_.push_back(std::move(tuple));
      } else {
        for (std::size_t k = i; k < end; ++k) lacks[found_[k].id] = true;
      }
    }
    return lacks;
  }

  // Whether every node has its counterparts.  Those that have not are set apart: at first only where it begins,
  // since what is made of them may have counterparts once they belong to no part, then all.
  bool is_complete(bool only_first) {
    const std::vector<bool> lacks = collect_tuples();
    bool is_complete = true;
    for (const Keyed& found : found_) {
      if (!lacks[found.id]) continue;
      is_complete = false;
      bool is_first = true;
      graph_.for_each_argument(found.id, [&](NodeId a) { is_first = is_first && !lacks[a]; });
      if (is_first || !only_first) apart_[found.id] = true;
    }
    return is_complete;
  }

  const Graph& graph_;
  std::size_t count_;
  std::vector<int> part_;           // by node
  std::vector<std::uint64_t> key_;  // of nodes and inputs that belong to a part
  std::vector<bool> apart_;
  struct Kind {
    std::uint64_t key;
    std::uint32_t count;  // so far
  };
  KeyTable alike_;
  std::vector<Kind> kinds_;   // of nodes that are alike
  std::vector<Keyed> found_;  // equal keys: counterparts
  std::vector<Tuple> tuples_;
};

}  // namespace

Repeats find_repeats(const Function& function) {
  const Graph& graph = function.graph;
  const Shapes shapes(graph);
  const std::size_t count = likely_count(shapes.alike);
  if (count < 2) return {};
  // Some walks lead astray, along the body of a humanoid instead of into its legs: only inputs that help are kept.
  // Each trial reads the whole graph: after a few that did not help, in a row, the smaller groups are left.
  constexpr int kMostInVain = 8;
  int in_vain = 0;
  std::vector<Tuple> inputs;
  Repeats best;
  for (const std::vector<Tuple>& group : Walks(graph, shapes, count).groups()) {
    if (group.size() * 8 < inputs.size() || in_vain == kMostInVain) break;
    std::vector<Tuple> more = inputs;
    more.insert(more.end(), group.begin(), group.end());
    const Parts parts(graph, count, more);
    if (parts.size() <= best.nodes.size() + best.nodes.size() / 32) {
      ++in_vain;
      continue;
    }
    in_vain = 0;
    best = parts.repeats(), inputs = std::move(more);
  }
  return best;
}

}  // namespace dyntape::codegen
