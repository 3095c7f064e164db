// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/graph.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/smooth_products.h>

namespace dyntape {
namespace {

std::uint64_t mix(std::uint64_t h) {  // the finaliser of a 64-bit multiplicative hash
  h ^= h >> 32;
  h *= 0xd6e8feb86659fd93u;
  h ^= h >> 32;
  h *= 0xd6e8feb86659fd93u;
  h ^= h >> 32;
  return h;
}

// For nodes of the table.  kNoNode + 1 is 0.
NodeId newest_argument(const Node& node) { return std::max({node.a + 1, node.b + 1, node.c + 1}) - 1; }

constexpr int kLargestIntegerPower = 16;  // pow(x, n) becomes products up to here

// The four sums of a product rounded once, by their signs.
bool negates_product(Op op) { return op == Op::Fnma || op == Op::Fnms; }
bool negates_sum(Op op) { return op == Op::Fms || op == Op::Fnms; }
Op fused(bool negative_product, bool negative_sum) {
  if (negative_product) return negative_sum ? Op::Fnms : Op::Fnma;
  return negative_sum ? Op::Fms : Op::Fma;
}

// Whether it is so by construction; a NaN is allowed.
bool is_never_negative(const Graph& graph, NodeId id) {
  std::size_t looks = std::size_t(1) << 16;  // what is shared is looked at again each time
  std::vector<NodeId> open = {id};
  while (!open.empty()) {
    if (--looks == 0) return false;
    const NodeId next = open.back();
    open.pop_back();
    const Node& node = graph[next];
    switch (node.op) {
      case Op::Const:  // nor -0
        if (std::signbit(graph.constant_value(next)) || !(graph.constant_value(next) >= 0)) return false;
        break;
      case Op::Sqrt:
      case Op::Abs:
      case Op::Hypot:
      case Op::Exp:
      case Op::Cosh:
        break;
      case Op::Mul:
        if (node.a == node.b) break;
        [[fallthrough]];
      case Op::Add:
      case Op::Max:
      case Op::Min:
        open.push_back(node.a), open.push_back(node.b);
        break;
      case Op::Div:  // not by a zero, whose sign may be any
        if (!graph.is_constant(node.b) || !(graph.constant_value(node.b) > 0)) return false;
        open.push_back(node.a);
        break;
      case Op::Fma:
        if (node.a != node.b) open.push_back(node.a), open.push_back(node.b);
        open.push_back(node.c);
        break;
      case Op::Select:
        open.push_back(node.b), open.push_back(node.c);
        break;
      default:
        return false;
    }
  }
  return true;
}

// The scale of a multiple of a root, applied to x.
NodeId scaled_as(Graph& graph, NodeId multiple, NodeId root, NodeId x) {
  if (multiple == root) return x;
  const Node node = graph[multiple];
  if (node.op == Op::Div) return graph.make(Op::Div, x, node.b);
  return graph.make(Op::Mul, node.a == root ? node.b : node.a, x);
}

// Of two multiples of one root; kNoNode: as other products.
NodeId smooth_product(Graph& graph, NodeId a, NodeId b) {
  const NodeId root = detail::root_in(graph, a);
  const Node node = graph[root];
  if (node.op == Op::Sqrt) {
    if (!is_never_negative(graph, node.a)) return kNoNode;
    return scaled_as(graph, b, root, scaled_as(graph, a, root, node.a));
  }
  const auto product = [&](NodeId x) {
    const NodeId left = scaled_as(graph, a, root, x);
    return graph.make(Op::Mul, left, scaled_as(graph, b, root, x));
  };
  const NodeId first = product(node.a);
  return node.op == Op::Abs ? first : graph.make(Op::Add, first, product(node.b));
}

NodeId product_of(Graph& graph, NodeId a, NodeId b) {
  const NodeId smooth = detail::share_a_root(graph, a, b) ? smooth_product(graph, a, b) : kNoNode;
  return smooth == kNoNode ? graph.make_plain(Op::Mul, a, b) : smooth;
}

}  // namespace

void detail::refuse_more_nodes() {
  throw RecordingError("graph: more than " + std::to_string(kMostNodes) + " nodes");
}

void Graph::make_room() {
  if (nodes_.size() >= kMostNodes) detail::refuse_more_nodes();
  const bool is_indexed = table_.room() > 0 || nodes_.empty();
  if (nodes_.size() == nodes_.capacity())
    nodes_.reserve(std::min(kMostNodes, std::max<std::size_t>(64, 2 * nodes_.size())));
  table_.make_room(nodes_.capacity());
  if (!is_indexed) index_nodes();
}

void Graph::index_nodes() {
  const auto none = [](NodeId) { return false; };  // all are different
  for (NodeId id = 0; id < nodes_.size(); ++id) {
    const Node& node = nodes_[id];
    if (node.op == Op::Const) {
      table_.add_constant(std::bit_cast<std::uint64_t>(constants_[node.a]), id);
    } else if (node.op == Op::Input || node.op == Op::Call) {
      table_.find_or_add_keyed(node.op == Op::Call ? call_key(node) : key(node), id, none);
    } else {
      const NodeId newest = node.op == Op::Result ? node.a : newest_argument(node);
      if (!table_.add_new(id, newest, bit_of(node.op, node.a, node.b, node.c)))
        table_.find_or_add_keyed(key(node), id, none);
    }
  }
}

NodeId Graph::find_or_append(Node node, NodeId newest_argument) {
  make_ready();
  const NodeId added = add_new(node.op, node.a, node.b, node.c, newest_argument);
  if (added != kNoNode) return added;
  table_.move_full_list(newest_argument, [&](NodeId id) { return key(nodes_[id]); });
  const NodeId known = table_.find(newest_argument, [&](NodeId id) { return nodes_[id] == node; });
  return known != kNoNode ? known : intern_by_key(node);
}

NodeId Graph::find_or_append_plain(Op op, NodeId a, NodeId b) {
  if (b < a && (op == Op::Add || op == Op::Mul)) std::swap(a, b);
  return find_or_append({op, a, b}, std::max(a, b));
}

NodeId Graph::intern_by_key(const Node& node) {
  const auto next = static_cast<NodeId>(nodes_.size());
  const NodeId id =
      table_.find_or_add_keyed(key(node), next, [&](NodeId other) { return nodes_[other] == node; });
  return id == next ? append(node.op, node.a, node.b, node.c) : id;
}

NodeId Graph::add_constant(double value) {
  table_.add_constant(std::bit_cast<std::uint64_t>(value), static_cast<NodeId>(nodes_.size()));
  constants_.push_back(value);
  return append(Op::Const, static_cast<NodeId>(constants_.size() - 1), kNoNode, kNoNode);
}

NodeId Graph::input(Block block, std::uint32_t index) {
  make_ready();
  return intern_by_key({Op::Input, static_cast<NodeId>(block), index, kNoNode});
}

NodeId Graph::make(Op op, NodeId a, NodeId b, NodeId c) {
  if (is_arithmetic(op) && !is_constant(a) && !is_constant(b)) return make_of_nodes(op, a, b);
  if (op == Op::Neg) return negation(a);
  const OpInfo& row = info(op);
  const bool folds = is_constant(a) && (row.arity < 2 || is_constant(b)) && (row.arity < 3 || is_constant(c));
  if (folds) {
    const double x = constant_value(a), y = row.arity > 1 ? constant_value(b) : 0,
                 z = row.arity > 2 ? constant_value(c) : 0;
    return constant(evaluate<double>(op, x, y, z));
  }
  // One canonical order makes a + b and b + a the same node.
  if ((row.laws & kCommutative) && b < a) std::swap(a, b);
  if (const NodeId simpler = simplified(op, a, b, c); simpler != kNoNode) return simpler;
  has_roots_ = has_roots_ || detail::is_root(op);
  return intern(op, a, b, c, newest_argument({op, a, b, c}));
}

NodeId Graph::simplified(Op op, NodeId a, NodeId b, NodeId c) {
  const std::uint32_t laws = info(op).laws;
  const Op inner = nodes_[a].op;
  if ((laws & kZeroLeft) && is_constant(a, 0)) return b;
  if ((laws & kZeroRight) && is_constant(b, 0)) return a;
  if ((laws & kOneLeft) && is_constant(a, 1)) return b;
  if ((laws & kOneRight) && is_constant(b, 1)) return a;
  if ((laws & kAbsorbLeft) && is_constant(a, 0)) return constant(0);
  if ((laws & kAbsorbRight) && is_constant(b, 0)) return constant(0);
  if ((laws & kIdempotent) && inner == op) return a;
  if ((laws & kInvolution) && inner == op) return nodes_[a].a;
  if ((laws & kEven) && inner == Op::Neg) return make(op, nodes_[a].a);
  if ((laws & kOdd) && inner == Op::Neg) return make(Op::Neg, make(op, nodes_[a].a));

  switch (op) {
    case Op::Add:
    case Op::Sub:
    case Op::Mul:
    case Op::Div:
      return simplified_signs(op, a, b);
    case Op::Azmul:  // a non-zero constant cannot be the strong zero
      return is_constant(a) ? make(Op::Mul, a, b) : kNoNode;
    case Op::Gate:  // nor can it close a gate; two gates of one condition are one; negations move outwards
      if (is_constant(a) || (nodes_[b].op == Op::Gate && nodes_[b].a == a)) return b;
      return nodes_[b].op == Op::Neg ? make(Op::Neg, make(Op::Gate, a, nodes_[b].a)) : kNoNode;
    case Op::Fma:
    case Op::Fms:
    case Op::Fnma:
    case Op::Fnms:
      return simplified_fused(op, a, b, c);
    case Op::Select:
      return simplified_select(a, b, c);
    case Op::Pow: {
      if (!is_constant(b)) return kNoNode;
      const double p = constant_value(b);
      if (p != std::floor(p) || std::abs(p) > kLargestIntegerPower) return kNoNode;
      return integer_power(a, static_cast<int>(p));
    }
    default:
      return kNoNode;
  }
}

NodeId Graph::negation(NodeId a) {
  const Node& node = nodes_[a];
  if (node.op == Op::Const) return constant(-constant_value(a));
  if (node.op == Op::Neg) return node.a;
  if (node.op == Op::Sub) return make(Op::Sub, node.b, node.a);
  return is_fused(node.op) ? negated_fused(node) : intern(Op::Neg, a, kNoNode, kNoNode, a);
}

NodeId Graph::make_of_nodes(Op op, NodeId a, NodeId b) {
  if (nodes_[a].op == Op::Neg || nodes_[b].op == Op::Neg) return make_of_negations(op, a, b);
  return op == Op::Mul ? product_of(*this, a, b) : make_plain(op, a, b);
}

Graph::Signed Graph::make_signed(Op op, Signed a, Signed b) {
  const NodeId x = a.node, y = b.node;
  if (op == Op::Mul) return {product_of(*this, x, y), a.is_negated != b.is_negated};
  if (op == Op::Div) return {make_plain(op, x, y), a.is_negated != b.is_negated};
  if (op == Op::Sub) b.is_negated = !b.is_negated;
  if (a.is_negated == b.is_negated) return {make_plain(Op::Add, x, y), a.is_negated};
  return {a.is_negated ? make_plain(Op::Sub, y, x) : make_plain(Op::Sub, x, y), false};
}

// What a negation is of is plain: sums, products and quotients of such are, too.
NodeId Graph::make_of_negations(Op op, NodeId a, NodeId b) {
  const auto signed_form = [&](NodeId id) {
    return nodes_[id].op == Op::Neg ? Signed{nodes_[id].a, true} : Signed{id, false};
  };
  const auto [id, is_negated] = make_signed(op, signed_form(a), signed_form(b));
  return is_negated ? intern(Op::Neg, id, kNoNode, kNoNode, id) : id;
}

NodeId Graph::simplified_signs(Op op, NodeId a, NodeId b) {
  const bool negative_a = nodes_[a].op == Op::Neg, negative_b = nodes_[b].op == Op::Neg;
  // By value: the recursive calls below may move nodes_.
  const NodeId inner_a = nodes_[a].a, inner_b = negative_b ? nodes_[b].a : kNoNode;
  switch (op) {
    case Op::Add:
      if (negative_b) return make(Op::Sub, a, inner_b);
      return negative_a ? make(Op::Sub, b, inner_a) : kNoNode;
    case Op::Sub:
      if (is_constant(a, 0)) return make(Op::Neg, b);
      if (negative_b) return make(Op::Add, a, inner_b);
      return negative_a ? make(Op::Neg, make(Op::Add, inner_a, b)) : kNoNode;
    case Op::Mul:
    case Op::Div: {
      const bool constant_a = is_constant(a);
      const double c = constant_value(constant_a ? a : b);
      if (negative_a) return make(op, inner_a, constant(-c));
      if (negative_b) return make(op, constant(-c), inner_b);
      if (c == -1 && (op == Op::Mul || !constant_a)) return make(Op::Neg, constant_a ? b : a);
      if (op == Op::Div && !constant_a) {  // division by a power of two is multiplication by its reciprocal
        int exponent;
        const double reciprocal = 1 / c;
        if (std::abs(std::frexp(c, &exponent)) == 0.5 && std::isnormal(reciprocal)) {
          return make(Op::Mul, a, constant(reciprocal));
        }
      }
      return kNoNode;
    }
    default:
      return kNoNode;
  }
}

// By value: making nodes moves them.
NodeId Graph::negated_fused(Node node) {
  return make(fused(!negates_product(node.op), !negates_sum(node.op)), node.a, node.b, node.c);
}

// Only what leaves one rounding.
NodeId Graph::simplified_fused(Op op, NodeId x, NodeId y, NodeId z) {
  bool minus_xy = negates_product(op), minus_z = negates_sum(op);
  const auto sum_with = [&](NodeId product) {
    if (minus_xy) product = make(Op::Neg, product);
    return make(minus_z ? Op::Sub : Op::Add, product, z);
  };
  if (is_constant(z, 0)) {
    const NodeId product = make(Op::Mul, x, y);
    return minus_xy ? make(Op::Neg, product) : product;
  }
  for (int i = 0; i < 2; ++i, std::swap(x, y)) {
    if (is_constant(x, 0)) return sum_with(x);
    if (is_constant(x, 1)) return sum_with(y);
    if (is_constant(x, -1)) return sum_with(make(Op::Neg, y));
  }
  if (minus_z && is_constant(z)) return make(fused(minus_xy, false), x, y, constant(-constant_value(z)));
  // Negations of arguments are part of the operation.
  bool changed = false;
  const auto take_sign = [&](NodeId& id, bool& sign) {
    if (nodes_[id].op != Op::Neg) return;
    id = nodes_[id].a;
    sign = !sign;
    changed = true;
  };
  take_sign(x, minus_xy);
  take_sign(y, minus_xy);
  take_sign(z, minus_z);
  return changed ? make(fused(minus_xy, minus_z), x, y, z) : kNoNode;
}

NodeId Graph::simplified_select(NodeId condition, NodeId a, NodeId b) {
  if (is_constant(condition)) return constant_value(condition) != 0 ? a : b;
  if (a == b) return a;
  const Node test = nodes_[condition];
  // select(select(c, 1, 0), a, b) and select(select(c, 0, 1), a, b): conditions made of conditions.
  if (test.op == Op::Select && is_constant(test.b, 1) && is_constant(test.c, 0))
    return make(Op::Select, test.a, a, b);
  if (test.op == Op::Select && is_constant(test.b, 0) && is_constant(test.c, 1))
    return make(Op::Select, test.a, b, a);
  // The same condition decides again inside a branch.
  if (nodes_[a].op == Op::Select && nodes_[a].a == condition)
    return make(Op::Select, condition, nodes_[a].b, b);
  if (nodes_[b].op == Op::Select && nodes_[b].a == condition)
    return make(Op::Select, condition, a, nodes_[b].c);
  return kNoNode;
}

NodeId Graph::integer_power(NodeId base, int exponent) {
  if (exponent == 0) return constant(1);
  if (exponent < 0) return reciprocal_power(base, -exponent);
  NodeId result = kNoNode, square = base;
  for (; exponent; exponent >>= 1) {
    if (exponent & 1) result = result == kNoNode ? square : make(Op::Mul, result, square);
    if (exponent > 1) square = make(Op::Mul, square, square);
  }
  return result;
}

// 1 / x^n is zero as soon as x^n overflows; with h = n / 2 the square of 1 / x^h is not, and costs the same.
NodeId Graph::reciprocal_power(NodeId base, int exponent) {
  if (exponent == 1) return make(Op::Div, constant(1), base);
  const NodeId root = make(Op::Div, constant(1), integer_power(base, exponent / 2));
  const NodeId square = make(Op::Mul, root, root);
  return exponent % 2 ? make(Op::Div, square, base) : square;
}

std::uint64_t Graph::call_key(const Node& call) const {
  std::uint64_t h = mix(call.a);
  for (std::size_t i = 0, n = callees_[call.a]->n_in; i < n; ++i) h = mix(h + call_arguments_[call.b + i]);
  return h;
}

NodeId Graph::place_of(const std::shared_ptr<const Callee>& callee) {
  if (const auto known = callee_places_.find(callee.get()); known != callee_places_.end())
    return known->second;
  check_pattern(*callee);
  const auto place = static_cast<NodeId>(callees_.size());
  callees_.push_back(callee);
  callee_places_.emplace(callee.get(), place);
  return place;
}

std::vector<NodeId> Graph::call(const std::shared_ptr<const Callee>& callee,
                                const std::vector<NodeId>& arguments) {
  if (arguments.size() != callee->n_in) {
    throw ArgumentError("call of \"" + callee->name + "\": got " + std::to_string(arguments.size()) +
                        " arguments, expected " + std::to_string(callee->n_in));
  }
  make_ready();
  const Node added{Op::Call, place_of(callee), static_cast<NodeId>(call_arguments_.size()), n_calls_};
  call_arguments_.insert(call_arguments_.end(), arguments.begin(), arguments.end());
  // An equal call is the same call.
  const auto is_it = [&](NodeId id) {
    const Node& node = nodes_[id];
    return node.op == Op::Call && node.a == added.a &&
           std::equal(arguments.begin(), arguments.end(), call_arguments_.begin() + node.b);
  };
  const auto next = static_cast<NodeId>(nodes_.size());
  const NodeId call = table_.find_or_add_keyed(call_key(added), next, is_it);
  if (call == next) {
    append(added.op, added.a, added.b, added.c);
    ++n_calls_;
  } else {
    call_arguments_.resize(added.b);
  }
  std::vector<NodeId> results(callee->n_out);
  for (std::size_t i = 0; i < results.size(); ++i) {
    results[i] = intern(Op::Result, call, static_cast<NodeId>(i), kNoNode, call);
  }
  return results;
}

void Graph::clear() {
  nodes_.clear();
  table_.clear();
  constants_.clear();
  callees_.clear();
  call_arguments_.clear();
  callee_places_.clear();
  n_calls_ = 0;
  has_roots_ = false;
}

std::size_t call_arity(const Graph& graph, NodeId call) { return graph.callees()[graph[call].a]->n_in; }

std::size_t Graph::bytes() const {
  return nodes_.capacity() * sizeof(Node) + table_.bytes() + constants_.capacity() * sizeof(double) +
         call_arguments_.capacity() * sizeof(NodeId);
}

bool has_pole(const Graph& graph, NodeId id) {
  const Node& node = graph[id];
  if (node.op == Op::Call) return graph.callees()[node.a]->has_poles;
  if (node.op == Op::Const) return !std::isfinite(graph.constant_value(id));
  const bool by_constant =
      node.op == Op::Div && graph.is_constant(node.b) && graph.constant_value(node.b) != 0;
  return (info(node.op).laws & kPole) && !by_constant;
}

}  // namespace dyntape
