// SPDX-License-Identifier: BSD-3-Clause
//
// The tape: an append-only array of small nodes in topological order.  record() (record.h) makes it from C++ code.
//
//   Graph g;
//   NodeId x = g.input(Block::kVariables, 0);
//   NodeId y = g.make(Op::Mul, g.make(Op::Sin, x), g.constant(2.0));     // 2 sin(x)
//   g.make(Op::Mul, g.constant(2.0), g.make(Op::Sin, x)) == y            // hash-consed: no new node
//
// An argument always precedes its user, so every sweep is a `for` loop, forwards or backwards.  make() simplifies
// with rewrites that are exact for finite values up to the sign of zero.  A *constant* zero or one is structural (x
// * 0 is 0, as in CppAD); an input that happens to be zero is never folded.  Only functions of the sign of a zero
// can show a difference: copysign(1, y), atan2(y, -1), 1 / y.
//
// Rewrites that may change the sign of a zero result:
//   x + 0, 0 + x, x - (-0)      -> x           -0 stays -0
//   0 - x                       -> -x          -0 for 0
//   0 * x, 0 / x                -> 0           for any sign of x
//   -(x - y)                    -> y - x       0 for -0 where x = y
//   (-x) + (-y), (-x) - y       -> -(x + y)    -0 for 0 where x = -y
//   -(x y + z) rounded once     -> -x y - z    0 for -0 where x y = -z; likewise with the signs of the product and of z
//   fma(x, y, 0), fma(0, y, z)  -> x y, z      as for sums and products; 0 - x y -> -(x y) likewise
//   azmul(0, y)                 -> 0           as for a product
//   sign(-x)                    -> -sign(x)    -0 for 0 at zero
// Not exact to the last bit: sqrt(a)^2 is a if a >= 0 by construction, and hypot(x, y)^2 is x x + y y; both have
// slopes at 0.  The sign of a NaN is undefined: the compiler chooses which of two NaN is the result, and copysign(1,
// NaN) may be either.
//
// To add an operator, add one row to ops.def.  record() (record.h) and derivation (derive.h) make nodes; the
// interpreter (interpret.h) and the C printer (codegen/print/print_c.h) read them.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include <dyntape/autodiff/graph/node_table.h>
#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

// The blocks of inputs.  Variables are differentiated.  Parameters change between evaluations and are never
// differentiated.  Weights are the additional inputs of a derivative: adjoint weights of vjp and Hessian, directions
// of jvp.
enum class Block : std::uint8_t { kVariables, kParameters, kWeights };
inline constexpr int kBlocks = 3;

struct Node {
  Op op;
  NodeId a = kNoNode, b = kNoNode, c = kNoNode;  // arguments; for structural kinds see Op

  NodeId argument(int i) const { return i == 0 ? a : i == 1 ? b : c; }
  bool operator==(const Node&) const = default;
};

struct Callee;  // callee.h: the target of a Call node

class Graph {
 public:
  Graph() = default;
  Graph(const Graph&) = default;
  Graph(Graph&&) = default;
  Graph& operator=(const Graph&) = default;
  Graph& operator=(Graph&&) = default;
  ~Graph() {
    if (nodes_.capacity() >= kLong) keep_memory();
  }

  // --- building: each returns the node with this value, existing or new ---
  NodeId constant(double value);
  NodeId input(Block block, std::uint32_t index);
  NodeId make(Op op, NodeId a, NodeId b = kNoNode, NodeId c = kNoNode);
  NodeId negation(NodeId a);  // make(Op::Neg, a)
  // Returns true if the negation of such a node has the same kind: -(x - y), -fma(x, y, z).
  static constexpr bool absorbs_negation(Op op) { return op == Op::Sub || is_fused(op); }
  static constexpr bool is_fused(Op op) {
    return op >= Op::Fma && op <= Op::Fnms;
  }  // a product with sum, rounded once
  // make() for + - * / without laws: the arguments are not negations, zeros, ones or the like.
  NodeId make_plain(Op op, NodeId a, NodeId b);
  // The same if this is quick; kNoNode: ask make_plain().
  NodeId add_new_plain(Op op, NodeId a, NodeId b);
  // + - * / of arguments that are not constants, each with a sign; negations move outwards.
  struct Signed {
    NodeId node;
    bool is_negated;
  };
  Signed make_signed(Op op, Signed a, Signed b);
  static constexpr bool is_arithmetic(Op op) {
    return op == Op::Add || op == Op::Sub || op == Op::Mul || op == Op::Div;
  }
  // The results of one call of a recorded function or kernel, (callee->n_out) nodes.
  std::vector<NodeId> call(const std::shared_ptr<const Callee>& callee, const std::vector<NodeId>& arguments);

  // --- reading ---
  std::size_t size() const { return nodes_.size(); }
  const Node& operator[](NodeId id) const { return nodes_[id]; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<double>& constants() const { return constants_; }
  const std::vector<std::shared_ptr<const Callee>>& callees() const { return callees_; }
  const std::vector<NodeId>& call_arguments() const { return call_arguments_; }

  // False: no node is a square root, an absolute value or a hypot (smooth_products.h).
  bool has_roots() const { return has_roots_; }
  bool is_constant(NodeId id) const { return nodes_[id].op == Op::Const; }
  double constant_value(NodeId id) const { return constants_[nodes_[id].a]; }
  bool is_constant(NodeId id, double value) const { return is_constant(id) && constant_value(id) == value; }

  // Visits the arguments of a node of any kind.
  template <class Visit>
  void for_each_argument(NodeId id, Visit&& visit) const;

  // Copies the nodes marked in `keep` (one flag per node; n_kept are 1; arguments of marked nodes must be marked) in
  // the same order.  image[id] is the copy of id, or kNoNode.  Takes the memory of the last long graph that this
  // thread destroyed, if that has about the right size: new pages cost as much as the copy.
  Graph extract(const std::vector<std::uint8_t>& keep, std::size_t n_kept, std::vector<NodeId>& image) const;

  // Memory in bytes.
  std::size_t bytes() const;
  // Empties the graph and keeps the memory for the next one.
  void clear();

 private:
  static std::uint64_t key(const Node& node);
  NodeId append(Op op, NodeId a, NodeId b, NodeId c);
  NodeId intern(Op op, NodeId a, NodeId b, NodeId c, NodeId newest_argument);
  NodeId add_constant(double value);
  static std::uint32_t bit_of(Op op, NodeId a, NodeId b, NodeId c);
  NodeId add_new(Op op, NodeId a, NodeId b, NodeId c,
                 NodeId newest_argument);  // kNoNode: may be known, or no room
  NodeId find_or_append(Node node, NodeId newest_argument);
  NodeId find_or_append_plain(Op op, NodeId a, NodeId b);
  NodeId intern_by_key(const Node& node);  // for nodes that are in no list
  std::uint64_t call_key(const Node& call) const;
  NodeId place_of(const std::shared_ptr<const Callee>& callee);  // index in callees_; appends if new
  void make_ready();                                             // prepares for the addition of a node
  void make_room();                                              // for more nodes
  void index_nodes();                                            // enters all nodes into the table
  // Appends a node of another graph.
  Node structural_copy(const Graph& source, const Node& node, const std::vector<NodeId>& image);
  Node copy_call(const Graph& source, const Node& node, const std::vector<NodeId>& image);
  NodeId simplified(Op op, NodeId a, NodeId b, NodeId c);  // by the laws of ops.def; kNoNode: no law applies
  NodeId make_of_nodes(Op op, NodeId a, NodeId b);         // + - * / of nodes that are not constants
  NodeId make_of_negations(Op op, NodeId a, NodeId b);     // if at least one is a negation
  NodeId simplified_signs(Op op, NodeId a, NodeId b);      // the same with a constant
  NodeId simplified_fused(Op op, NodeId x, NodeId y, NodeId z);  // fma and similar operators
  NodeId negated_fused(Node node);
  NodeId simplified_select(NodeId condition, NodeId a, NodeId b);
  NodeId integer_power(NodeId base, int exponent);
  NodeId reciprocal_power(NodeId base, int exponent);  // 1 / x^n, n > 0

  static constexpr std::size_t kLong = 8192;  // nodes
  void keep_memory();

  std::vector<Node> nodes_;
  NodeTable table_;  // without room until a node is added; a read-only graph has none
  bool has_roots_ = false;
  std::vector<double> constants_;
  std::vector<std::shared_ptr<const Callee>> callees_;
  std::unordered_map<const Callee*, NodeId> callee_places_;  // index in callees_
  std::vector<NodeId> call_arguments_;
  NodeId n_calls_ = 0;
};

// Number of arguments of a Call node.
std::size_t call_arity(const Graph& graph, NodeId call);

// Returns true if the value or a slope of a node may be infinite although its arguments are finite.
bool has_pole(const Graph& graph, NodeId id);

// The most variable part of a node, the older argument or an input's index, comes last (KeyTable).
inline std::uint64_t Graph::key(const Node& node) {
  const bool is_input = node.op == Op::Input;
  const NodeId last = is_input ? node.b : node.a, other = is_input ? node.a : node.b;
  const std::uint64_t rest =
      (std::uint64_t(node.c) << 32 | other) * 0x9e3779b97f4a7c15u + std::uint64_t(node.op);
  return (rest ^ rest >> 32) << 32 | last;
}

// Writes field by field from registers: a node assembled in memory would have to be stored before it can be read as
// a whole.
[[gnu::always_inline]] inline NodeId Graph::append(Op op, NodeId a, NodeId b, NodeId c) {
  const std::size_t id = nodes_.size();
  if (id >= kMostNodes) __builtin_unreachable();
  if (nodes_.size() == nodes_.capacity()) __builtin_unreachable();  // make_ready() has made room
  Node& node = nodes_.emplace_back();
  node.op = op;
  node.a = a;
  node.b = b;
  node.c = c;
  return static_cast<NodeId>(id);
}

inline void Graph::make_ready() {
  if (nodes_.size() >= table_.room()) [[unlikely]]
    make_room();
}

inline NodeId Graph::constant(double value) {
  make_ready();
  const NodeId known = table_.find_constant(std::bit_cast<std::uint64_t>(value));
  return known != kNoNode ? known : add_constant(value);
}

inline std::uint32_t Graph::bit_of(Op op, NodeId a, NodeId b, NodeId c) {
  return NodeTable::bit_of(a + 3 * b + 5 * c + (static_cast<std::uint32_t>(op) << 24));
}

[[gnu::always_inline]] inline NodeId Graph::add_new(Op op, NodeId a, NodeId b, NodeId c,
                                                    NodeId newest_argument) {
  if (!table_.add_new(nodes_.size(), newest_argument, bit_of(op, a, b, c))) [[unlikely]]
    return kNoNode;
  return append(op, a, b, c);
}

inline NodeId Graph::intern(Op op, NodeId a, NodeId b, NodeId c, NodeId newest_argument) {
  const NodeId added = add_new(op, a, b, c, newest_argument);
  return added != kNoNode ? added : find_or_append({op, a, b, c}, newest_argument);
}

// One canonical order makes a + b and b + a the same node.  Without branches: which argument is older is at random.
[[gnu::always_inline]] inline NodeId Graph::add_new_plain(Op op, NodeId a, NodeId b) {
  const NodeId is_newer = NodeId{0} - NodeId{b < a};  // all bits or none
  const NodeId commutes = NodeId{0} - NodeId{op == Op::Add || op == Op::Mul};
  const NodeId difference = (a ^ b) & is_newer;
  const NodeId swapped = difference & commutes;
  return add_new(op, a ^ swapped, b ^ swapped, kNoNode, b ^ difference);
}

inline NodeId Graph::make_plain(Op op, NodeId a, NodeId b) {
  const NodeId added = add_new_plain(op, a, b);
  return added != kNoNode ? added : find_or_append_plain(op, a, b);
}

template <class Visit>
void Graph::for_each_argument(NodeId id, Visit&& visit) const {
  const Node& node = nodes_[id];
  if (node.op == Op::Call) {
    for (std::size_t i = 0, n = call_arity(*this, id); i < n; ++i) visit(call_arguments_[node.b + i]);
  } else if (node.op == Op::Result) {
    visit(node.a);
  } else {
    for (int i = 0; i < info(node.op).arity; ++i) visit(node.argument(i));
  }
}

}  // namespace dyntape
