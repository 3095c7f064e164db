// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/cppad/detail/recording.h>

namespace CppAD::inline dyntape_names::detail {

namespace {

struct AbsParts {
  Function g, a;
};

// In the order in which they were recorded.
AbsParts split_at_abs(const Function& f, std::size_t range) {
  if (!f.graph.callees().empty())
    refuse("abs_normal_fun: the function calls functions of the user, expected operators alone");
  const std::size_t n = f.n_x();
  Graph graph;
  std::vector<NodeId> image(f.graph.size(), kNoNode), arguments, absolutes;
  for (NodeId id = 0; id < f.graph.size(); ++id) {
    const Node& node = f.graph[id];
    const auto of = [&](NodeId argument) { return argument == kNoNode ? kNoNode : image[argument]; };
    if (node.op == Op::Input) {
      image[id] = graph.input(static_cast<Block>(node.a), node.b);
    } else if (node.op == Op::Const) {
      image[id] = graph.constant(f.graph.constant_value(id));
    } else if (node.op == Op::Abs) {
      image[id] = graph.input(Block::kVariables, static_cast<std::uint32_t>(n + absolutes.size()));
      arguments.push_back(of(node.a)), absolutes.push_back(id);
    } else {
      image[id] = graph.make(node.op, of(node.a), of(node.b), of(node.c));
    }
  }
  std::vector<NodeId> outputs;
  for (std::size_t i = 0; i < range; ++i) outputs.push_back(image[f.outputs[i]]);
  outputs.insert(outputs.end(), arguments.begin(), arguments.end());
  std::vector<Guard> guards = f.guards;
  for (Guard& guard : guards) guard.condition = image[guard.condition];
  AbsParts parts{live_part(graph, outputs, guards), live_part(f.graph, absolutes, {})};
  parts.g.inputs = parts.a.inputs = f.inputs;
  parts.g.inputs[0] = n + absolutes.size();
  parts.g.name = f.name, parts.a.name = f.name + "_abs";
  return parts;
}

}  // namespace

template <class Base>
AbsNormal<Base> abs_normal_of(const Recording<Base>& f) {
  AbsParts parts = split_at_abs(*f.function, f.range);
  const auto recording_of = [&](Function function) {
    auto recording = std::make_shared<Recording<Base>>();
    recording->range = function.outputs.size();
    recording->captured = f.captured, recording->dynamics = f.dynamics, recording->variables = f.variables;
    recording->variables.resize(function.n_x());
    if (!function.guards.empty()) recording->guard_counts = f.guard_counts;
    recording->function = std::make_shared<const Function>(std::move(function));
    return recording;
  };
  return {recording_of(std::move(parts.g)), recording_of(std::move(parts.a))};
}

template AbsNormal<float> abs_normal_of(const Recording<float>&);
template AbsNormal<double> abs_normal_of(const Recording<double>&);
template AbsNormal<AD<double>> abs_normal_of(const Recording<AD<double>>&);
template AbsNormal<AD<AD<double>>> abs_normal_of(const Recording<AD<AD<double>>>&);

}  // namespace CppAD::inline dyntape_names::detail
