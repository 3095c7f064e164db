// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dyntape/autodiff/error.h>

namespace dyntape {

template <class T>
std::vector<T> evaluate_as(const Function& function, const std::vector<T>& x, const std::vector<T>& p,
                           const std::vector<T>& w) {
  detail::check_sizes(function, x.size(), p.size(), w.size());
  const Graph& graph = function.graph;
  const std::vector<T>* blocks[] = {&x, &p, &w};
  std::vector<T> value(graph.size());
  std::vector<std::vector<T>> results;  // of call number i
  for (NodeId id = 0; id < graph.size(); ++id) {
    const Node& node = graph[id];
    switch (node.op) {
      case Op::Const:
        value[id] = T(graph.constants()[node.a]);
        break;
      case Op::Input:
        value[id] = (*blocks[node.a])[node.b];
        break;
      case Op::Call: {
        const Callee& callee = *graph.callees()[node.a];
        const auto recorded = detail::recorded_form(callee);
        if (!recorded)
          throw ArgumentError("evaluate_as: kernel \"" + callee.name + "\" exists in double only");
        std::vector<T> arguments;
        graph.for_each_argument(id, [&](NodeId a) { arguments.push_back(value[a]); });
        results.resize(std::max<std::size_t>(results.size(), node.c + 1));
        results[node.c] = evaluate_as<T>(*recorded, arguments);
        break;
      }
      case Op::Result:
        value[id] = results[graph[node.a].c][node.b];
        break;
      default: {
        const int n = info(node.op).arity;
        value[id] =
            evaluate<T>(node.op, value[node.a], n > 1 ? value[node.b] : T(0), n > 2 ? value[node.c] : T(0));
      }
    }
  }
  std::vector<T> y;
  for (NodeId id : function.outputs) y.push_back(value[id]);
  return y;
}

}  // namespace dyntape
