// SPDX-License-Identifier: BSD-3-Clause
//
// A node with operators, for the evaluation of derivation rules.  Valid only inside a GraphScope.
//
//   GraphScope scope(graph);
//   Expr y = sin(Expr{x}) * Expr(2.0);
#pragma once

#include <dyntape/autodiff/graph/graph.h>

namespace dyntape {

// Names the graph that Expr operators append to, in this thread, until the scope ends.
class GraphScope {
 public:
  explicit GraphScope(Graph& graph) : previous_(current_) { current_ = &graph; }
  ~GraphScope() { current_ = previous_; }
  GraphScope(const GraphScope&) = delete;
  GraphScope& operator=(const GraphScope&) = delete;

  static Graph& graph() { return *current_; }

 private:
  static constinit inline thread_local Graph* current_ = nullptr;
  Graph* previous_;
};

struct Expr {
  NodeId id = kNoNode;
  // Of what a cell of the table passes on: where it does so, if not everywhere.
  NodeId condition = kNoNode;
  bool positive = true;

  Expr() = default;
  explicit Expr(NodeId node) : id(node) {}
  explicit Expr(double value) : id(GraphScope::graph().constant(value)) {}
  explicit Expr(int value) : Expr(double(value)) {}

  bool exists() const { return id != kNoNode; }
};

#define OP(name, fn, n, ...) DYNTAPE_EXPR_##n(name, fn)
#define DYNTAPE_EXPR_1(name, fn) \
  inline Expr fn(Expr a) { return Expr(GraphScope::graph().make(Op::name, a.id)); }
#define DYNTAPE_EXPR_2(name, fn) \
  inline Expr fn(Expr a, Expr b) { return Expr(GraphScope::graph().make(Op::name, a.id, b.id)); }
#define DYNTAPE_EXPR_3(name, fn)                                       \
  inline Expr fn(Expr a, Expr b, Expr c) {                             \
    return Expr(GraphScope::graph().make(Op::name, a.id, b.id, c.id)); \
  }
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_EXPR_1
#undef DYNTAPE_EXPR_2
#undef DYNTAPE_EXPR_3

inline Expr where(Expr condition, Expr v) { return v.condition = condition.id, v; }
inline Expr unless(Expr condition, Expr v) { return v.condition = condition.id, v.positive = false, v; }

// Conditions say what does not move or has no weight; a value of zero does not (flow.h).
inline Expr at_pole(Expr v, Expr slope) { return v * slope; }

// Conditions of the table are written as comparisons with operators.
inline Expr operator<(Expr a, Expr b) { return less(a, b); }
inline Expr operator>(Expr a, Expr b) { return less(b, a); }
inline Expr operator==(Expr a, Expr b) { return equal(a, b); }

namespace ops {
// No slope: no node, so that nothing is added to an adjoint.
template <>
inline Expr zero_slope<Expr>() {
  return Expr();
}
}  // namespace ops

}  // namespace dyntape
