// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/passes/outline.h>

#include <algorithm>
#include <map>
#include <utility>

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/strong_components.hpp>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/codegen/passes/repeats.h>

namespace dyntape::codegen {
namespace {

// Code of this length stays in the first-level cache: 4000 operations are 32 kB.
constexpr std::size_t kShort = 4000;

using Tuple = std::vector<NodeId>;

// The parts cannot be computed one after the other, or are not the same after all.
struct Entangled {};

// Without the few nodes of which one part's depends on another's: a sum that goes from leg to leg, say.  All counterparts being
// one vertex, they are those on a cycle.
Repeats without_entangled(const Graph& graph, Repeats repeats) {
  const std::size_t n = repeats.nodes.size();
  std::vector<std::size_t> vertex(graph.size());
  for (NodeId id = 0; id < graph.size(); ++id) vertex[id] = n + id;
  for (std::size_t k = 0; k < n; ++k) {
    for (NodeId id : repeats.nodes[k]) vertex[id] = k;
  }
  boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS> uses(n + graph.size());
  std::vector<bool> is_entangled(n, false);
  for (NodeId id = 0; id < graph.size(); ++id) {
    graph.for_each_argument(id, [&](NodeId a) {
      if (vertex[a] == vertex[id]) is_entangled[vertex[id]] = true;
      boost::add_edge(vertex[a], vertex[id], uses);
    });
  }
  std::vector<std::size_t> cycle(n + graph.size()), size(n + graph.size(), 0);
  boost::strong_components(uses, cycle.data());
  for (std::size_t c : cycle) ++size[c];
  Repeats apart{repeats.count, {}};
  for (std::size_t k = 0; k < n; ++k) {
    if (size[cycle[k]] == 1 && !is_entangled[k]) apart.nodes.push_back(std::move(repeats.nodes[k]));
  }
  return apart;
}

class Outliner {
 public:
  Outliner(const Function& function, const Repeats& repeats)
      : function_(function),
        graph_(function.graph),
        repeats_(repeats),
        row_(graph_.size(), kNone),
        phase_(graph_.size(), 0),
        image_(graph_.size(), kNoNode),
        copies_(repeats.nodes.size(), kNoNode) {
    for (std::size_t k = 0; k < repeats.nodes.size(); ++k) {
      for (NodeId id : repeats.nodes[k]) row_[id] = k;
    }
  }

  Function run() {
    find_phases();
    divide_by_phase();
    find_uses();
    Function result{function_.name,        function_.inputs,      {}, function_.outputs, function_.guards,
                    function_.input_names, function_.output_names};
    for (std::size_t phase = 0; phase <= last_phase_; ++phase) {
      copy_between(phase, result.graph);
      call_parts(phase, result.graph);
    }
    for (NodeId& id : result.outputs) id = image_of(id, result.graph);
    for (Guard& guard : result.guards) guard.condition = image_of(guard.condition, result.graph);
    return result;
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  bool is_repeated(NodeId id) const { return row_[id] != kNone; }

  // In each phase come first the nodes that belong to no part, then the parts: what uses results of parts
  // without being one is of the next phase.
  void find_phases() {
    for (int round = 0; round < 20; ++round) {
      for (NodeId id = 0; id < graph_.size(); ++id) {
        graph_.for_each_argument(id, [&](NodeId a) {
          const bool leaves = is_repeated(a) && !is_repeated(id);
          phase_[id] = std::max(phase_[id], phase_[a] + (leaves ? 1 : 0));
        });
      }
      bool is_settled = true;
      for (const Tuple& tuple : repeats_.nodes) {
        std::size_t phase = 0;
        for (NodeId id : tuple) phase = std::max(phase, phase_[id]);
        for (NodeId id : tuple) {
          is_settled = is_settled && phase_[id] == phase;
          phase_[id] = phase;
        }
      }
      if (is_settled) {
        last_phase_ = *std::max_element(phase_.begin(), phase_.end());
        return;
      }
    }
    throw Entangled();
  }

  // What is computed in each phase: nodes of no part, and rows of the parts.
  void divide_by_phase() {
    between_.resize(last_phase_ + 1), rows_.resize(last_phase_ + 1);
    for (NodeId id = 0; id < graph_.size(); ++id) {
      if (!is_repeated(id)) between_[phase_[id]].push_back(id);
    }
    for (std::size_t k = 0; k < repeats_.nodes.size(); ++k) rows_[phase_[repeats_.nodes[k][0]]].push_back(k);
  }

  // Which nodes something reads that is not computed in the same call, and which outputs they are.
  void find_uses() {
    read_.assign(graph_.size(), false), output_.assign(graph_.size(), 0);
    for (NodeId id = 0; id < graph_.size(); ++id) {
      graph_.for_each_argument(
          id, [&](NodeId a) { read_[a] = read_[a] || !is_repeated(id) || phase_[id] != phase_[a]; });
    }
    for (const Guard& guard : function_.guards) read_[guard.condition] = true;
    for (std::size_t k = 0; k < function_.outputs.size(); ++k) output_[function_.outputs[k]] = k + 1;
  }
  bool is_result(NodeId id) const { return read_[id] || output_[id] != 0; }

  NodeId image_of(NodeId id, Graph& target) {
    const Node& node = graph_[id];
    if (node.op == Op::Const) return target.constant(graph_.constant_value(id));
    if (node.op == Op::Input) return target.input(static_cast<Block>(node.a), node.b);
    return image_[id];
  }

  void copy_between(std::size_t phase, Graph& target) {
    for (NodeId id : between_[phase]) {
      const Node& node = graph_[id];
      const auto argument = [&](int i) {
        return i < info(node.op).arity ? image_of(node.argument(i), target) : kNoNode;
      };
      if (is_operation(node)) {
        image_[id] = target.make(node.op, argument(0), argument(1), argument(2));
      } else if (node.op == Op::Call) {
        Tuple arguments;
        graph_.for_each_argument(id, [&](NodeId a) { arguments.push_back(image_of(a, target)); });
        results_[id] = target.call(graph_.callees()[node.a], arguments);
      } else if (node.op == Op::Result) {
        image_[id] = results_.at(node.a)[node.b];
      }
    }
  }

  // The function of a part, and what each part calls it with.
  struct Part {
    Function function;
    std::vector<Tuple> arguments, constants, results;
  };

  void call_parts(std::size_t phase, Graph& target) {
    Part part = part_of(phase);
    if (part.results.empty()) return;
    const auto function = std::make_shared<const Function>(std::move(part.function));
    const auto callee =
        std::make_shared<const Callee>("part", part.arguments.size() + part.constants.size(),
                                       part.results.size(), Recorded{function, Recorded::Use::kPart});
    for (std::size_t i = 0; i < repeats_.count; ++i) {
      Tuple arguments;
      for (const auto* tuples : {&part.arguments, &part.constants}) {
        for (const Tuple& tuple : *tuples) arguments.push_back(image_of(tuple[i], target));
      }
      const Tuple results = target.call(callee, arguments);
      for (std::size_t k = 0; k < results.size(); ++k) image_[part.results[k][i]] = results[k];
    }
  }

  Part part_of(std::size_t phase) {
    Part part;
    std::map<Tuple, NodeId> arguments;
    Graph& graph = part.function.graph;
    for (std::size_t k : rows_[phase]) {
      const Tuple& tuple = repeats_.nodes[k];
      const Node& node = graph_[tuple[0]];
      std::array<NodeId, 3> copied{kNoNode, kNoNode, kNoNode};
      for (int j = 0; j < info(node.op).arity; ++j) {
        const Tuple argument = argument_of(tuple, j);
        NodeId& copy = copied[static_cast<std::size_t>(j)];
        const NodeId first = argument[0];
        const bool is_same =
            std::all_of(argument.begin(), argument.end(), [&](NodeId a) { return a == first; });
        if (is_repeated(first) && phase_[first] == phase) {
          if (std::any_of(argument.begin(), argument.end(), [&](NodeId a) { return row_[a] != row_[first]; }))
            throw Entangled();
          copy = copies_[row_[first]];
        } else if (is_same && graph_.is_constant(first)) {
          copy = graph.constant(graph_.constant_value(first));
        } else {
          const auto [entry, is_new] = arguments.emplace(argument, kNoNode);
          if (is_new) {
            const bool varies = std::any_of(argument.begin(), argument.end(),
                                            [&](NodeId a) { return !graph_.is_constant(a); });
            std::vector<Tuple>& tuples = varies ? part.arguments : part.constants;
            entry->second = graph.input(varies ? Block::kVariables : Block::kParameters,
                                        static_cast<std::uint32_t>(tuples.size()));
            tuples.push_back(argument);
          }
          copy = entry->second;
        }
      }
      copies_[k] = graph.make(node.op, copied[0], copied[1], copied[2]);
      if (std::any_of(tuple.begin(), tuple.end(), [&](NodeId id) { return is_result(id); }))
        part.results.push_back(tuple);
    }
    sort_results(part.results);
    for (const Tuple& tuple : part.results) part.function.outputs.push_back(copies_[row_[tuple[0]]]);
    part.function.name = "part";
    part.function.inputs = {part.arguments.size(), part.constants.size(), 0};
    return part;
  }

  // Those that are outputs and nothing else come last, equally distant ones side by side: one pointer leads to them
  // (call_layout.h).
  void sort_results(std::vector<Tuple>& results) const {
    const auto distances = [&](const Tuple& tuple) {
      std::vector<std::size_t> key;
      for (NodeId id : tuple) {
        if (output_[id] == 0 || read_[id]) return std::vector<std::size_t>();
        key.push_back(output_[id] - output_[tuple[0]]);
      }
      key.push_back(output_[tuple[0]]);
      return key;
    };
    std::map<NodeId, std::vector<std::size_t>> keys;
    for (const Tuple& tuple : results) keys[tuple[0]] = distances(tuple);
    std::stable_sort(results.begin(), results.end(),
                     [&](const Tuple& a, const Tuple& b) { return keys[a[0]] < keys[b[0]]; });
  }

  // The argument of each node of the tuple that stands where argument j of the first does.
  Tuple argument_of(const Tuple& tuple, int j) const {
    const Node& first = graph_[tuple[0]];
    const bool commutes = (info(first.op).laws & kCommutative) != 0;
    Tuple arguments;
    for (NodeId id : tuple) {
      const Node& node = graph_[id];
      const bool swaps = commutes && !(are_alike(first.a, node.a) && are_alike(first.b, node.b));
      arguments.push_back(node.argument(swaps && j < 2 ? 1 - j : j));
    }
    return arguments;
  }

  // Counterparts, or both of no part.
  bool are_alike(NodeId a, NodeId b) const {
    if (is_repeated(a) || is_repeated(b)) return row_[a] == row_[b];
    return (graph_[a].op == Op::Const) == (graph_[b].op == Op::Const);
  }

  const Function& function_;
  const Graph& graph_;
  const Repeats& repeats_;
  std::vector<std::size_t> row_, phase_;  // by node
  std::size_t last_phase_ = 0;
  std::vector<std::vector<NodeId>> between_;    // by phase
  std::vector<std::vector<std::size_t>> rows_;  // by phase
  std::vector<bool> read_;                      // by node
  std::vector<std::size_t> output_;             // by node: 1 + number; 0: it is none
  std::vector<NodeId> image_;
  std::vector<NodeId> copies_;                     // by row, in the function of the part
  std::map<NodeId, std::vector<NodeId>> results_;  // of the calls that were there
};

}  // namespace

Function outlined(const Function& function) {
  const auto n = static_cast<std::size_t>(
      std::count_if(function.graph.nodes().begin(), function.graph.nodes().end(), is_operation));
  if (n < kShort) return function;
  const Repeats repeats = without_entangled(function.graph, find_repeats(function));
  const std::size_t saved = repeats.count < 2 ? 0 : (repeats.count - 1) * repeats.nodes.size();
  if (saved * 3 < n) return function;  // of a humanoid's two sides a quarter is not worth its calls
  try {
    return Outliner(function, repeats).run();
  } catch (const Entangled&) {
    return function;
  }
}

}  // namespace dyntape::codegen
