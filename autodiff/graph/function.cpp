// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/function.h>

#include <algorithm>
#include <array>
#include <map>
#include <mutex>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/callee.h>

namespace dyntape {
namespace {

// Everything that must stay alive: outputs and the conditions of guards.
std::vector<NodeId> roots_of(const Function& function) {
  std::vector<NodeId> roots = function.outputs;
  for (const Guard& guard : function.guards) roots.push_back(guard.condition);
  return roots;
}

// Sets one flag a node: 1 if the roots need it.  Returns how many do.  Branches on the flags could not be predicted, nor
// those on a second argument: the flag behind the last node is that of an argument that a node does not have.
std::size_t mark_needed(const Graph& graph, const std::vector<NodeId>& roots,
                        std::vector<std::uint8_t>& needed) {
  const auto n = static_cast<NodeId>(graph.size());
  needed.assign(graph.size() + 1, 0);
  const Node* const nodes = graph.nodes().data();
  std::uint8_t* const flags = needed.data();
  for (NodeId root : roots) flags[root] = 1;
  std::size_t count = 0;
  for (NodeId id = n; id-- > 0;) {
    const Node& node = nodes[id];
    const std::uint8_t flag = flags[id];
    count += flag;
    if (is_table_op(node.op)) {
      flags[node.a] |= flag;
      flags[std::min(node.b, n)] |= flag;
      if (node.c != kNoNode) flags[node.c] |= flag;
    } else if (flag) {
      graph.for_each_argument(id, [&](NodeId a) { flags[a] = 1; });
    }
  }
  return count;
}

// The function with another graph, given the images there of roots_of(function).
Function with_graph(const Function& function, Graph graph, const std::vector<NodeId>& images) {
  const auto outputs_end = images.begin() + static_cast<std::ptrdiff_t>(function.outputs.size());
  Function result{function.name,   function.inputs,      std::move(graph),     {images.begin(), outputs_end},
                  function.guards, function.input_names, function.output_names};
  for (std::size_t i = 0; i < result.guards.size(); ++i) result.guards[i].condition = outputs_end[i];
  // A guard whose condition became a constant either always holds or is kept to report.
  std::erase_if(result.guards, [&](const Guard& guard) {
    return result.graph.is_constant(guard.condition) &&
           (result.graph.constant_value(guard.condition) != 0) == guard.expected;
  });
  return result;
}

// The function with its graph rebuilt, inputs replaced by `input`.
Function rebuilt(const Function& function, const std::function<NodeId(Graph&, Block, std::uint32_t)>& input) {
  Graph graph;
  const std::vector<NodeId> images =
      splice(function.graph, roots_of(function), graph,
             [&](Block block, std::uint32_t index) { return input(graph, block, index); });
  return with_graph(function, std::move(graph), images);
}

using InputImage = std::function<NodeId(Block, std::uint32_t)>;

// Results of dissolved calls, by callee and arguments: an equal call is the same call.
using DissolvedCalls = std::map<std::pair<const Callee*, std::vector<NodeId>>, std::vector<NodeId>>;

std::vector<NodeId> dissolved_call(const std::shared_ptr<const Callee>& callee,
                                   const std::vector<NodeId>& arguments, Graph& target,
                                   DissolvedCalls& dissolved);

// As splice(); `dissolved`, unless there is none: calls of callees that dissolve become their statements; `gates`,
// unless it is empty: the images of the nodes that are conditions of gates.
std::vector<NodeId> spliced(const Graph& source, const std::vector<NodeId>& roots, Graph& target,
                            const InputImage& input, DissolvedCalls* dissolved,
                            const std::vector<NodeId>& gates = {}) {
  std::vector<std::uint8_t> needed;
  mark_needed(source, roots, needed);
  std::vector<NodeId> image(source.size(), kNoNode);
  std::vector<std::vector<NodeId>> results;  // of call number i
  for (NodeId id = 0; id < source.size(); ++id) {
    if (!needed[id]) continue;
    const Node& node = source[id];
    switch (node.op) {
      case Op::Const:
        image[id] = target.constant(source.constant_value(id));
        break;
      case Op::Input:
        image[id] = input(static_cast<Block>(node.a), node.b);
        break;
      case Op::Call: {
        std::vector<NodeId> arguments;
        source.for_each_argument(id, [&](NodeId a) { arguments.push_back(image[a]); });
        results.resize(std::max<std::size_t>(results.size(), node.c + 1));
        const auto& callee = source.callees()[node.a];
        results[node.c] = dissolved && callee->dissolves()
                              ? dissolved_call(callee, arguments, target, *dissolved)
                              : target.call(callee, arguments);
        break;
      }
      case Op::Result:
        image[id] = results[source[node.a].c][node.b];
        break;
      default: {
        const int n = info(node.op).arity;
        const bool gate = node.op == Op::Gate && !gates.empty();
        image[id] = target.make(node.op, gate ? gates[node.a] : image[node.a],
                                n > 1 ? image[node.b] : kNoNode, n > 2 ? image[node.c] : kNoNode);
      }
    }
  }
  std::vector<NodeId> images;
  for (NodeId root : roots) images.push_back(image[root]);
  return images;
}

std::vector<NodeId> dissolved_call(const std::shared_ptr<const Callee>& callee,
                                   const std::vector<NodeId>& arguments, Graph& target,
                                   DissolvedCalls& dissolved) {
  if (const auto known = dissolved.find({callee.get(), arguments}); known != dissolved.end())
    return known->second;
  const Function& function = *callee->recorded()->function;
  const std::vector<NodeId> results = spliced(
      function.graph, function.outputs, target, [&](Block, std::uint32_t i) { return arguments[i]; },
      &dissolved);
  dissolved.emplace(std::pair(callee.get(), arguments), results);
  return results;
}

}  // namespace

std::vector<NodeId> splice(const Graph& source, const std::vector<NodeId>& roots, Graph& target,
                           const std::function<NodeId(Block, std::uint32_t)>& input) {
  return spliced(source, roots, target, input, nullptr);
}

Function dissolved(const Function& function) {
  const auto& callees = function.graph.callees();
  if (std::none_of(callees.begin(), callees.end(), [](const auto& c) { return c->dissolves(); }))
    return compact(function);
  Graph graph;
  DissolvedCalls calls;
  const std::vector<NodeId> images = spliced(
      function.graph, roots_of(function), graph, [&](Block b, std::uint32_t i) { return graph.input(b, i); },
      &calls);
  return compact(with_graph(function, std::move(graph), images));
}

// What was simplified as it was built stays as it is: the live nodes are copied, in their order.
Function live_part(const Graph& graph, const std::vector<NodeId>& outputs, const std::vector<Guard>& guards,
                   LivePartMemory&& memory) {
  Function result;
  result.outputs = outputs;
  result.guards = guards;
  std::vector<NodeId> roots = roots_of(result);
  const std::size_t count = mark_needed(graph, roots, memory.needed);
  Graph live = graph.extract(memory.needed, count, memory.image);
  for (NodeId& root : roots) root = memory.image[root];
  return with_graph(result, std::move(live), roots);
}

Function compact(const Function& function) {
  check(function);
  Function live = live_part(function.graph, function.outputs, function.guards);
  live.name = function.name;
  live.inputs = function.inputs;
  live.input_names = function.input_names;
  live.output_names = function.output_names;
  return live;
}

Function bind(const Function& function, Block block, const std::vector<Binding>& bindings) {
  const std::size_t n = function.inputs[static_cast<int>(block)];
  std::vector<const double*> value(n, nullptr);
  for (const Binding& binding : bindings) {
    if (binding.index >= n) {
      throw ArgumentError("bind: input " + std::to_string(binding.index) + " of \"" + function.name +
                          "\" does not exist; the block has " + std::to_string(n));
    }
    value[binding.index] = &binding.value;
  }
  Function result = rebuilt(function, [&](Graph& graph, Block b, std::uint32_t index) {
    return b == block && value[index] ? graph.constant(*value[index]) : graph.input(b, index);
  });
  if (std::find(value.begin(), value.end(), nullptr) == value.end()) {
    result.inputs[static_cast<int>(block)] = 0;
    result.input_names[static_cast<int>(block)].clear();
  }
  return compact(result);
}

namespace {

// What becomes of conditions of gates where no weight is zero, one node for each of the source that is one.
std::vector<NodeId> opened_gates(const Graph& source, Graph& target, const InputImage& input) {
  std::vector<NodeId> conditions, images(source.size(), kNoNode);
  for (const Node& node : source.nodes()) {
    if (node.op == Op::Gate) conditions.push_back(node.a);
  }
  const std::vector<NodeId> opened = splice(source, conditions, target, [&](Block b, std::uint32_t i) {
    return b == Block::kWeights ? target.constant(1) : input(b, i);
  });
  for (std::size_t k = 0; k < conditions.size(); ++k) images[conditions[k]] = opened[k];
  return images;
}

Function as_variables(const Function& function, bool open_gates) {
  const std::size_t n_x = function.n_x(), n_w = function.n_w(), n_p = function.n_p();
  Graph graph;
  const InputImage input = [&](Block block, std::uint32_t index) {
    const std::size_t offset = block == Block::kVariables ? 0 : block == Block::kWeights ? n_x : n_x + n_w;
    return graph.input(Block::kVariables, static_cast<std::uint32_t>(offset + index));
  };
  const std::vector<NodeId> gates =
      open_gates ? opened_gates(function.graph, graph, input) : std::vector<NodeId>{};
  const std::vector<NodeId> images =
      spliced(function.graph, roots_of(function), graph, input, nullptr, gates);
  Function result = with_graph(function, std::move(graph), images);
  result.inputs = {n_x + n_w + n_p, 0, 0};
  result.input_names = {};
  return compact(result);
}

}  // namespace

Function all_as_variables(const Function& function) { return as_variables(function, true); }

Function weights_as_variables(const Function& function) { return as_variables(function, false); }

Function select_outputs(const Function& function, const std::vector<std::size_t>& outputs) {
  Function result = function;
  result.outputs.clear();
  result.output_names.clear();
  for (std::size_t i : outputs) {
    if (i >= function.n_y()) {
      throw ArgumentError("select_outputs: output " + std::to_string(i) + " of \"" + function.name +
                          "\" does not exist; it has " + std::to_string(function.n_y()));
    }
    result.outputs.push_back(function.outputs[i]);
    if (!function.output_names.empty()) result.output_names.push_back(function.output_names[i]);
  }
  return compact(result);
}

void check(const Function& function) {
  const Graph& graph = function.graph;
  const auto fail = [&](const std::string& what) {
    throw RecordingError("function \"" + function.name + "\": " + what);
  };
  const auto demand = [&](bool holds, NodeId id, const char* what) {
    if (!holds)
      fail("node " + std::to_string(id) + " (" + std::string(info(graph[id].op).name) + ") " + what);
  };
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    if (is_table_op(node.op)) {  // of most nodes no more needs to be looked at
      const int n = info(node.op).arity;
      if (node.a < id && (n < 2 || node.b < id) && (n < 3 || node.c < id)) continue;
    }
    if (node.op == Op::Const) {
      demand(node.a < graph.constants().size(), id, "has no value");
    } else if (node.op == Op::Input) {
      demand(node.a < kBlocks && node.b < function.inputs[node.a], id, "reads an input that is not declared");
    } else if (node.op == Op::Call) {
      demand(node.a < graph.callees().size() &&
                 node.b + graph.callees()[node.a]->n_in <= graph.call_arguments().size(),
             id, "calls what does not exist");
    }
    graph.for_each_argument(id,
                            [&](NodeId a) { demand(a < id, id, "uses a node that does not precede it"); });
    if (node.op == Op::Result) {
      demand(graph[node.a].op == Op::Call && node.b < graph.callees()[graph[node.a].a]->n_out, id,
             "is not the result of a call");
    }
  }
  for (NodeId root : roots_of(function)) {
    if (root >= graph.size()) fail("an output does not exist");
  }
}

std::vector<OperationCount> count_operations(const Callee& callee) {
  if (const Kernel* kernel = callee.kernel()) return kernel->operations;
  static std::mutex mutex;
  auto& made = callee.made.operations;
  {
    const std::scoped_lock lock(mutex);
    if (made) return *made;
  }
  auto operations = count_operations(*callee.recorded()->function);  // and of what that calls: once each
  const std::scoped_lock lock(mutex);
  if (!made) made = std::move(operations);
  return *made;
}

std::vector<OperationCount> count_operations(const Function& function) {
  check(function);
  const Graph& graph = function.graph;
  std::vector<std::uint8_t> needed;
  mark_needed(graph, roots_of(function), needed);
  std::array<std::size_t, std::size(kOpInfo)> counts{};
  std::vector<std::size_t> calls(graph.callees().size(), 0);
  for (NodeId id = 0; id < graph.size(); ++id) {
    if (!needed[id]) continue;
    ++counts[static_cast<int>(graph[id].op)];
    if (graph[id].op == Op::Call) ++calls[graph[id].a];
  }
  for (std::size_t k = 0; k < calls.size(); ++k) {
    if (calls[k] == 0) continue;
    for (const OperationCount& entry : count_operations(*graph.callees()[k]))
      counts[static_cast<int>(entry.op)] += calls[k] * entry.count;
  }
  std::vector<OperationCount> result;
  for (int op = 0; op < static_cast<int>(counts.size()); ++op) {
    const auto kind = static_cast<Op>(op);
    if (counts[op] && (op < kTableOps || kind == Op::Call)) result.push_back({kind, counts[op]});
  }
  return result;
}

std::size_t total_operations(const Function& function) {
  std::size_t total = 0;
  for (const OperationCount& entry : count_operations(function)) total += entry.count;
  return total;
}

}  // namespace dyntape
