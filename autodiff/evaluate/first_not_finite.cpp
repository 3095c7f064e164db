// SPDX-License-Identifier: BSD-3-Clause
//
// Where a value that is not finite came from: an evaluation node by node that keeps all values.
#include <cmath>
#include <map>
#include <sstream>

#include <dyntape/autodiff/evaluate/interpret.h>

namespace dyntape {
namespace {

// "node 3 (Input): variable 0 (height) = nan"
std::string bad_input(const Function& function, NodeId id, double value) {
  const Node& node = function.graph[id];
  const auto& names = function.input_names[node.a];
  const char* const blocks[] = {"variable", "parameter", "weight"};
  std::ostringstream text;
  text << "node " << id << " (Input): " << blocks[node.a] << " " << node.b;
  if (node.b < names.size()) text << " (" << names[node.b] << ")";
  text << " = " << value;
  return text.str();
}

// "node 17 (Log): of (-1) = nan"
std::string bad_operation(const Graph& graph, NodeId id, const std::vector<double>& arguments, double value) {
  const Node& node = graph[id];
  std::ostringstream text;
  text.precision(17);
  text << "node " << id << " (" << info(node.op).name << ")";
  if (node.op == Op::Result) text << ": " << graph.callees()[graph[node.a].a]->name;
  text << ": of (";
  for (std::size_t i = 0; i < arguments.size(); ++i) text << (i ? ", " : "") << arguments[i];
  text << ") = " << value;
  return text.str();
}

}  // namespace

std::string first_not_finite(const Function& function, const double* x, const double* p, const double* w) {
  const Graph& graph = function.graph;
  const double* const blocks[] = {x, p, w};
  std::vector<double> values(graph.size()), arguments;
  std::map<NodeId, std::vector<double>> results;  // of the Call nodes
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    arguments.clear();
    graph.for_each_argument(node.op == Op::Result ? node.a : id,
                            [&](NodeId a) { arguments.push_back(values[a]); });
    double& value = values[id];
    switch (node.op) {
      case Op::Const:
        value = graph.constant_value(id);
        continue;
      case Op::Input:
        value = blocks[node.a][node.b];
        if (!std::isfinite(value)) return bad_input(function, id, value);
        continue;
      case Op::Call:
        results[id].resize(graph.callees()[node.a]->n_out);
        evaluate(*graph.callees()[node.a], arguments.data(), results[id].data());
        continue;
      case Op::Result:
        value = results[node.a][node.b];
        break;
      default: {
        const auto argument = [&](std::size_t i) { return i < arguments.size() ? arguments[i] : 0.0; };
        value = evaluate<double>(node.op, argument(0), argument(1), argument(2));
      }
    }
    bool finite = true;
    for (double argument : arguments) finite = finite && std::isfinite(argument);
    if (finite && !std::isfinite(value)) return bad_operation(graph, id, arguments, value);
  }
  return {};
}

}  // namespace dyntape
