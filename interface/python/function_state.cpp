// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function as plain data, for pickle: its statements, by the names of the operators, so that another version of
// the table reads them or says what it lacks.
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cstring>
#include <map>

#include <dyntape/autodiff/error.h>

#include "functions.h"

namespace dyntape::python {
namespace {

constexpr int kVersion = 1;

// Version, name, sizes of the blocks, shape of y, operators, nodes (4 numbers each: operator, arguments), constants,
// outputs, guards (condition, expected, file, line).
using GuardState = std::tuple<std::uint32_t, bool, std::string, int>;
using FunctionState = std::tuple<int, std::string, std::vector<std::size_t>, Shape, std::vector<std::string>,
                                 nb::bytes, nb::bytes, std::vector<std::uint32_t>, std::vector<GuardState>>;

template <class T>
nb::bytes bytes_of(const std::vector<T>& values) {
  return nb::bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <class T>
std::vector<T> values_of(const nb::bytes& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.c_str(), values.size() * sizeof(T));
  return values;
}

[[noreturn]] void refuse(const std::string& why) { throw ArgumentError("a pickled function " + why); }

FunctionState state_of(const RecordedFunction& f) {
  const Function function = dissolved(f.function);
  const Graph& graph = function.graph;
  std::map<Op, std::uint32_t> places;
  std::vector<std::string> operators;
  std::vector<std::uint32_t> nodes;
  for (const Node& node : graph.nodes()) {
    if (!is_table_op(node.op) && node.op != Op::Const && node.op != Op::Input) {
      throw ArgumentError(
          "\"" + function.name +
          "\" calls a kernel, which cannot be pickled; pickle the functions of which it is made");
    }
    const auto [place, is_new] = places.try_emplace(node.op, static_cast<std::uint32_t>(operators.size()));
    if (is_new) operators.emplace_back(info(node.op).name);
    nodes.insert(nodes.end(), {place->second, node.a, node.b, node.c});
  }
  std::vector<GuardState> guards;
  for (const Guard& g : function.guards) guards.emplace_back(g.condition, g.expected, g.file, g.line);
  return {kVersion,
          function.name,
          {function.n_x(), function.n_p(), function.n_w()},
          f.y_shape,
          operators,
          bytes_of(nodes),
          bytes_of(graph.constants()),
          function.outputs,
          guards};
}

Op operator_named(const std::string& name) {
  for (int i = 0; i < kTableOps + 2; ++i) {
    if (name == info(static_cast<Op>(i)).name) return static_cast<Op>(i);
  }
  refuse("has the operator " + name + ", which this version does not know");
}

// The nodes once more, in a graph that looks at each.
std::vector<NodeId> rebuild(Graph& graph, const std::vector<Op>& operators,
                            const std::vector<std::uint32_t>& nodes, const std::vector<double>& constants,
                            const std::vector<std::size_t>& sizes) {
  std::vector<NodeId> images;
  for (std::size_t i = 0; i + 3 < nodes.size(); i += 4) {
    const std::uint32_t a = nodes[i + 1], b = nodes[i + 2];
    if (nodes[i] >= operators.size()) refuse("is damaged");
    const Op op = operators[nodes[i]];
    if (op == Op::Const) {
      if (a >= constants.size()) refuse("is damaged");
      images.push_back(graph.constant(constants[a]));
    } else if (op == Op::Input) {
      if (a >= sizes.size() || b >= sizes[a]) refuse("is damaged");
      images.push_back(graph.input(static_cast<dyntape::Block>(a), b));
    } else {
      NodeId arguments[3] = {kNoNode, kNoNode, kNoNode};
      for (int k = 0; k < info(op).arity; ++k) {
        if (nodes[i + 1 + std::size_t(k)] >= images.size()) refuse("is damaged");
        arguments[k] = images[nodes[i + 1 + std::size_t(k)]];
      }
      images.push_back(graph.make(op, arguments[0], arguments[1], arguments[2]));
    }
  }
  return images;
}

void restore(RecordedFunction& f, const FunctionState& state) {
  const auto& [version, name, sizes, y_shape, names, node_bytes, constant_bytes, outputs, guards] = state;
  if (version != kVersion || sizes.size() != kBlocks) refuse("is of another version");
  std::vector<Op> operators;
  for (const std::string& one : names) operators.push_back(operator_named(one));
  Function function;
  function.name = name;
  std::copy(sizes.begin(), sizes.end(), function.inputs.begin());
  const std::vector<NodeId> images = rebuild(function.graph, operators, values_of<std::uint32_t>(node_bytes),
                                             values_of<double>(constant_bytes), sizes);
  const auto image = [&](std::uint32_t node) {
    if (node >= images.size()) refuse("is damaged");
    return images[node];
  };
  for (const std::uint32_t output : outputs) function.outputs.push_back(image(output));
  for (const auto& [condition, expected, file, line] : guards)
    function.guards.push_back({image(condition), expected, file, line});
  const Block block{"y", y_shape};
  if (block.size() != outputs.size()) refuse("is damaged");
  new (&f) RecordedFunction(std::move(function), y_shape);
}

}  // namespace

void bind_function_state(nb::class_<RecordedFunction>& f) {
  f.def("__getstate__", state_of, nb::sig("def __getstate__(self) -> tuple[Any, ...]"),
        "The statements of the graph, for pickle.  Dynamics of robots inside become statements like others: "
        "values keep their bits,\nderivatives are those of the statements.");
  f.def("__setstate__", restore, nb::sig("def __setstate__(self, state: tuple[Any, ...], /) -> None"));
}

}  // namespace dyntape::python
