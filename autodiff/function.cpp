// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/function.h>

#include <algorithm>
#include <array>

#include <dyntape/autodiff/callee.h>
#include <dyntape/autodiff/error.h>

namespace dyntape {
namespace {

// Everything that must stay alive: outputs and the conditions of guards.
std::vector<NodeId> roots_of(const Function& function) {
  std::vector<NodeId> roots = function.outputs;
  for (const Guard& guard : function.guards) roots.push_back(guard.condition);
  return roots;
}

// The function with its graph rebuilt, inputs replaced by `input`.
Function rebuilt(const Function& function, const std::function<NodeId(Graph&, Block, std::uint32_t)>& input) {
  Function result = function;
  result.graph = Graph();
  const std::vector<NodeId> images =
      splice(function.graph, roots_of(function), result.graph,
             [&](Block block, std::uint32_t index) { return input(result.graph, block, index); });
  const std::size_t n = function.outputs.size();
  std::copy(images.begin(), images.begin() + static_cast<std::ptrdiff_t>(n), result.outputs.begin());
  for (std::size_t i = 0; i < function.guards.size(); ++i) result.guards[i].condition = images[n + i];
  // A guard whose condition became a constant either always holds or is kept to report.
  std::erase_if(result.guards, [&](const Guard& guard) {
    return result.graph.is_constant(guard.condition) &&
           (result.graph.constant_value(guard.condition) != 0) == guard.expected;
  });
  return result;
}

}  // namespace

std::vector<NodeId> splice(const Graph& source, const std::vector<NodeId>& roots, Graph& target,
                           const std::function<NodeId(Block, std::uint32_t)>& input) {
  NodeId end = 0;
  for (NodeId root : roots) end = std::max(end, root + 1);
  std::vector<bool> needed(end, false);
  for (NodeId root : roots) needed[root] = true;
  for (NodeId id = end; id-- > 0;) {
    if (needed[id]) source.for_each_argument(id, [&](NodeId a) { needed[a] = true; });
  }
  std::vector<NodeId> image(end, kNoNode);
  std::vector<std::vector<NodeId>> results;  // of call number i
  for (NodeId id = 0; id < end; ++id) {
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
        results[node.c] = target.call(source.callees()[node.a], arguments);
        break;
      }
      case Op::Result:
        image[id] = results[source[node.a].c][node.b];
        break;
      default: {
        const int n = info(node.op).arity;
        image[id] = target.make(node.op, image[node.a], n > 1 ? image[node.b] : kNoNode,
                                n > 2 ? image[node.c] : kNoNode);
      }
    }
  }
  std::vector<NodeId> images;
  for (NodeId root : roots) images.push_back(image[root]);
  return images;
}

Function compact(const Function& function) {
  return rebuilt(function,
                 [](Graph& graph, Block block, std::uint32_t index) { return graph.input(block, index); });
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
  return rebuilt(function, [&](Graph& graph, Block b, std::uint32_t index) {
    return b == block && value[index] ? graph.constant(*value[index]) : graph.input(b, index);
  });
}

Function all_as_variables(const Function& function) {
  const std::size_t n_x = function.n_x(), n_w = function.n_w(), n_p = function.n_p();
  Function result = rebuilt(function, [&](Graph& graph, Block block, std::uint32_t index) {
    const std::size_t offset = block == Block::kVariables ? 0 : block == Block::kWeights ? n_x : n_x + n_w;
    return graph.input(Block::kVariables, static_cast<std::uint32_t>(offset + index));
  });
  result.inputs = {n_x + n_w + n_p, 0, 0};
  result.input_names = {};
  return result;
}

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
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    graph.for_each_argument(id, [&](NodeId a) {
      if (a >= id)
        fail("node " + std::to_string(id) + " (" + std::string(info(node.op).name) + ") uses node " +
             std::to_string(a) + ", which does not precede it");
    });
    if (node.op == Op::Input && (node.a >= kBlocks || node.b >= function.inputs[node.a])) {
      fail("node " + std::to_string(id) + " reads an input that is not declared");
    }
    if (node.op == Op::Result &&
        (graph[node.a].op != Op::Call || node.b >= graph.callees()[graph[node.a].a]->n_out)) {
      fail("node " + std::to_string(id) + " is not the result of a call");
    }
  }
  for (NodeId root : roots_of(function)) {
    if (root >= graph.size()) fail("an output does not exist");
  }
}

std::vector<OperationCount> count_operations(const Function& function) {
  const Function live = compact(function);
  std::array<std::size_t, std::size(kOpInfo)> counts{};
  for (const Node& node : live.graph.nodes()) ++counts[static_cast<int>(node.op)];
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
