// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function as a list of operators, in CppAD's C++ and JSON formats.  Use it to exchange functions with
// other programs.
//
//   cpp_graph graph;
//   f.to_graph(graph);                                 // f: ADFun<double>
//   graph.print(std::cout);
//   g.from_graph(graph);
//   g.from_json(f.to_json());
//
// Nodes are numbered from 1: dynamic parameters, variables, constants, and the results of the operators in order.
// operator_arg holds the arguments of all operators, one after the other:
//   unary, binary, cexp_*   nodes (1, 2, 4: left, right, if true, if false)
//   comp_*                  two nodes whose comparison was true at the recording point; no result
//   sum                     the number of nodes, then the nodes
//   discrete                index of the name, node
//   atom, atom4             index of the name, (atom4: call id,) number of results, number of arguments, nodes
//   print                   indices of the texts before and after, nodes of the flag and the value; no result
#pragma once

#include <cstddef>
#include <ostream>
#include <string>

#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

namespace graph {

// As in CppAD: alphabetical.
// clang-format off
#define DYNTAPE_CPPAD_GRAPH_OPS(V) \
  V(abs, 1) V(acos, 1) V(acosh, 1) V(add, 2) V(asin, 1) V(asinh, 1) V(atan, 1) V(atanh, 1) \
  V(atom4, 0) V(atom, 0) V(azmul, 2) V(cexp_eq, 4) V(cexp_le, 4) V(cexp_lt, 4) V(comp_eq, 0) \
  V(comp_le, 0) V(comp_lt, 0) V(comp_ne, 0) V(cos, 1) V(cosh, 1) V(discrete, 0) V(div, 2) \
  V(erf, 1) V(erfc, 1) V(exp, 1) V(expm1, 1) V(log1p, 1) V(log, 1) V(mul, 2) V(neg, 1) \
  V(pow, 2) V(print, 0) V(sign, 1) V(sin, 1) V(sinh, 1) V(sqrt, 1) V(sub, 2) V(sum, 0) \
  V(tan, 1) V(tanh, 1)
// clang-format on

#define DYNTAPE_CPPAD_GRAPH_OP(name, n_arg) name##_graph_op,
enum graph_op_enum { DYNTAPE_CPPAD_GRAPH_OPS(DYNTAPE_CPPAD_GRAPH_OP) n_graph_op };
#undef DYNTAPE_CPPAD_GRAPH_OP

}  // namespace graph

class cpp_graph {
 public:
  using Size = std::size_t;

  void initialize() { *this = cpp_graph(); }

#define DYNTAPE_CPPAD_GRAPH_SCALAR(Type, name)       \
  const Type& name##_get() const { return name##_; } \
  void name##_set(const Type& value) { name##_ = value; }
#define DYNTAPE_CPPAD_GRAPH_VECTOR(Type, name)                           \
  const Type& name##_get(Size i) const { return name##_[i]; }            \
  Size name##_size() const { return name##_.size(); }                    \
  void name##_push_back(const Type& value) { name##_.push_back(value); } \
  /* The index of the value, or how many there are. */                   \
  Size name##_find(const Type& value) const {                            \
    Size i = 0;                                                          \
    while (i < name##_.size() && !(name##_[i] == value)) ++i;            \
    return i;                                                            \
  }
  DYNTAPE_CPPAD_GRAPH_SCALAR(std::string, function_name)
  DYNTAPE_CPPAD_GRAPH_SCALAR(Size, n_dynamic_ind)
  DYNTAPE_CPPAD_GRAPH_SCALAR(Size, n_variable_ind)
  DYNTAPE_CPPAD_GRAPH_VECTOR(std::string, atomic_name_vec)
  DYNTAPE_CPPAD_GRAPH_VECTOR(std::string, discrete_name_vec)
  DYNTAPE_CPPAD_GRAPH_VECTOR(std::string, print_text_vec)
  DYNTAPE_CPPAD_GRAPH_VECTOR(double, constant_vec)
  DYNTAPE_CPPAD_GRAPH_VECTOR(graph::graph_op_enum, operator_vec)
  DYNTAPE_CPPAD_GRAPH_VECTOR(Size, operator_arg)
  DYNTAPE_CPPAD_GRAPH_VECTOR(Size, dependent_vec)
#undef DYNTAPE_CPPAD_GRAPH_SCALAR
#undef DYNTAPE_CPPAD_GRAPH_VECTOR

  // A line a node, and the nodes of the results.
  void print(std::ostream& out) const;
  std::string to_json() const;
  // ArgumentError for text that is no JSON, or no graph.
  static cpp_graph from_json(const std::string& text);

 private:
  std::string function_name_;
  Size n_dynamic_ind_ = 0, n_variable_ind_ = 0;
  vector<std::string> atomic_name_vec_, discrete_name_vec_, print_text_vec_;
  vector<double> constant_vec_;
  vector<graph::graph_op_enum> operator_vec_;
  vector<Size> operator_arg_, dependent_vec_;
};

namespace detail {

struct GraphOp {
  const char* name;
  std::size_t n_arg;  // 0: said by each use
};
const GraphOp& graph_op(graph::graph_op_enum op);

// One use of an operator, its arguments by kind.
struct GraphUse {
  graph::graph_op_enum op;
  std::size_t name = 0, call_id = 0,
              n_result = 1;  // name: index in its vector of names, or of the text before
  std::size_t after = 0;     // of print
  vector<std::size_t> nodes{};
};
// The use that begins at `place` of operator_arg, which moves behind it.  ArgumentError if arguments are missing or nodes come later.
GraphUse read_use(const cpp_graph& graph, std::size_t op, std::size_t& place, std::size_t n_nodes);
void append_use(cpp_graph& graph, const GraphUse& use);

template <class Base>
struct Recording;
void write_graph(const Recording<double>& recording, cpp_graph& graph);
// Which inputs change sides: empty, none.
template <class Base>
std::shared_ptr<const Recording<Base>> read_graph(const cpp_graph& graph,
                                                  const vector<bool>& dynamic_to_variable,
                                                  const vector<bool>& variable_to_dynamic);

}  // namespace detail
}  // namespace CppAD::inline dyntape_names
