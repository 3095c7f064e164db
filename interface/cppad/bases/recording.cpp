// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <dyntape/interface/cppad/bases/any_base.h>
#include <dyntape/interface/cppad/bases/tape.h>
#include <dyntape/interface/cppad/detail/patterns.h>

namespace CppAD::inline dyntape_names::detail {

std::string begun_at(const Begin& begin) {
  if (!begin.file) return "";
  return ", begun at " + std::string(begin.file) + ":" + std::to_string(begin.line) + ",";
}

// Of the nodes up to the last one; those that are there are known.
void find_kinds(const Graph& graph, NodeId last, std::vector<Kind>& kinds) {
  for (auto next = static_cast<NodeId>(kinds.size()); next <= last; ++next) {
    const Node& node = graph[next];
    Kind kind = Kind::kConstant;
    if (node.op == Op::Input) {
      kind = node.a == static_cast<NodeId>(Block::kVariables)    ? Kind::kVariable
             : node.a == static_cast<NodeId>(Block::kParameters) ? Kind::kDynamic
                                                                 : Kind::kConstant;
    } else {
      graph.for_each_argument(next, [&](NodeId a) { kind = std::max(kind, kinds[a]); });
    }
    kinds.push_back(kind);
  }
}

std::vector<Kind> kinds_of(const Graph& graph) {
  std::vector<Kind> kinds;
  kinds.reserve(graph.size());
  if (graph.size() > 0) find_kinds(graph, static_cast<NodeId>(graph.size() - 1), kinds);
  return kinds;
}

RecordingSizes count_sizes(const Function& function, const std::vector<Print>& prints) {
  const std::vector<Kind> kinds = kinds_of(function.graph);
  RecordingSizes sizes;
  for (NodeId id = 0; id < function.graph.size(); ++id) {
    const Kind kind = kinds[id];
    const Op op = function.graph[id].op;
    std::size_t arguments = 0;
    function.graph.for_each_argument(id, [&](NodeId) { ++arguments; });
    sizes.constants += op == Op::Const;
    sizes.operations += kind == Kind::kVariable;
    sizes.variables += kind == Kind::kVariable && op != Op::Call;
    sizes.dynamics += kind == Kind::kDynamic;
    (kind == Kind::kDynamic ? sizes.dynamic_arguments : sizes.arguments) += arguments;
  }
  sizes.dynamics = std::max(sizes.dynamics, function.n_p());
  sizes.variables = std::max(sizes.variables, function.n_x());
  sizes.operations = std::max(sizes.operations, function.n_x());
  for (const Print& print : prints) sizes.text += print.before.size() + print.after.size() + 2;
  return sizes;
}

std::vector<bool> parameters_of(const Function& function, std::size_t range) {
  const std::vector<Kind> kinds = kinds_of(function.graph);
  std::vector<bool> are_parameters(range);
  for (std::size_t i = 0; i < range; ++i) are_parameters[i] = kinds[function.outputs[i]] != Kind::kVariable;
  return are_parameters;
}

void refuse_order_of_complex(const char* function) {
  refuse(std::string(function) + ": the base is std::complex, whose numbers have no order");
}

void refuse_missing(const char* function) {
  refuse(std::string(function) +
         ": the base of AD<Base> has no such function; CppAD's base_require lists those that it needs");
}

}  // namespace CppAD::inline dyntape_names::detail
