// SPDX-License-Identifier: BSD-3-Clause
//
// Where a value or a slope that is not finite came from: an evaluation node by node that keeps all values.
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include <dyntape/autodiff/evaluate/first_without_slope.h>
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

using First = std::string (*)(const Function&, const double* x, const double* p, const double* w);

// look(id, arguments, value) of each node in order, until it returns a text; `within` the recorded functions that are called.
template <class Look>
std::string first_of(const Function& function, const double* x, const double* p, const double* w,
                     First within, const Look& look) {
  const Graph& graph = function.graph;
  const double* const blocks[] = {x, p, w};
  std::vector<double> values(graph.size()), arguments;
  std::map<NodeId, std::vector<double>> results;  // of the Call nodes
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    arguments.clear();
    graph.for_each_argument(node.op == Op::Result ? node.a : id,
                            [&](NodeId a) { arguments.push_back(values[a]); });
    const auto argument = [&](std::size_t i) { return i < arguments.size() ? arguments[i] : 0.0; };
    double& value = values[id];
    switch (node.op) {
      case Op::Const:
        value = graph.constant_value(id);
        continue;
      case Op::Input:
        value = blocks[node.a][node.b];
        break;
      case Op::Call: {
        const Callee& callee = *graph.callees()[node.a];
        results[id].resize(callee.n_out);
        evaluate(callee, arguments.data(), results[id].data());
        const bool is_finite =
            std::all_of(arguments.begin(), arguments.end(), [](double a) { return std::isfinite(a); });
        const Recorded* recorded = callee.recorded();
        if (!is_finite || !recorded || recorded->function->n_x() != callee.n_in) continue;
        if (std::string text = within(*recorded->function, arguments.data(), nullptr, nullptr); !text.empty())
          return text;
        continue;
      }
      case Op::Result:
        value = results[node.a][node.b];
        break;
      default:
        value = evaluate<double>(node.op, argument(0), argument(1), argument(2));
    }
    if (std::string text = look(id, arguments, value); !text.empty()) return text;
  }
  return {};
}

}  // namespace

std::string first_not_finite(const Function& function, const double* x, const double* p, const double* w) {
  return first_of(function, x, p, w, first_not_finite,
                  [&](NodeId id, const std::vector<double>& arguments, double value) -> std::string {
                    if (std::isfinite(value)) return {};
                    if (function.graph[id].op == Op::Input) return bad_input(function, id, value);
                    for (double argument : arguments) {
                      if (!std::isfinite(argument)) return {};
                    }
                    return bad_operation(function.graph, id, arguments, value);
                  });
}

std::string first_without_slope(const Function& function, const double* x, const double* p, const double* w) {
  return first_of(
      function, x, p, w, first_without_slope,
      [&](NodeId id, const std::vector<double>& arguments, double value) -> std::string {
        const Op op = function.graph[id].op;
        if (!is_table_op(op) || !std::isfinite(value)) return {};
        const auto at = [&](std::size_t i) { return i < arguments.size() ? arguments[i] : 0.0; };
        for (std::size_t i = 0; i < arguments.size(); ++i) {
          const bool moves = !function.graph.is_constant(function.graph[id].argument(int(i)));
          if (!moves || std::isfinite(slope(op, int(i), at(0), at(1), at(2), value, 1.0))) continue;
          std::ostringstream text;
          text << "node " << id << " (" << info(op).name << ") of " << at(i) << " has no slope";
          if (op == Op::Sqrt)
            text << "; write norm(v, smoothing) for the length of a vector, or sqrt(a + smoothing^2)";
          if (op == Op::Div) text << "; write safe_divide(a, b, smoothing)";
          return text.str();
        }
        return {};
      });
}

}  // namespace dyntape
