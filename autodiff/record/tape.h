// SPDX-License-Identifier: BSD-3-Clause
//
// An open recording, and the arithmetic of recorded values: each operation computes a value and adds a node to the
// graph.  Internal.
//
//   using Record = RecordedArithmetic<Policy>;
//   Value y = Record::apply<Op::Mul>(a, b);
//
// A recorded value has value(), id(), tape() (the serial number of its recording) and is_recorded().  A value that
// is not recorded is a constant.  dyntape::AD (record.cpp) and CppAD's AD<Base> (interface/cppad/bases/recorded.hxx)
// share this code.  They differ in their policies:
//
//   Value, Base, Tape     the value, the type of its number, and the recording (derived from detail::Tape)
//   current()             the recording whose values take the quick path, or null
//   other(values...)      the recording of values if some are not of current(); null: all values are constants
//   outside(tape, a)      the node of a value from outside this recording: a constant or an input; else throws
//   is_plain(a)           true if a value that is not recorded is a plain number
//   number(a)             the number of a value as a double
//   is_constant(a, b)     whether b is a constant of the recording that an operation on a and b adds to
//   evaluate<op>(x, y, z) the operation on Base
//   check(tape)           called after each node that does not take the quick path
#pragma once

#include <cmath>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/graph.h>
#include <dyntape/autodiff/graph/smooth_products.h>

namespace dyntape::detail {

struct Tape {
  // Takes the memory of this thread's last recording; the destructor keeps the memory for the next recording.
  Tape();
  ~Tape();
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;

  // Adds a guard: the condition had this value at the recording point.  Each condition is guarded once.
  void guard(NodeId condition, bool expected, const char* file, int line);

  std::uint32_t serial;  // never 0
  Graph graph;
  std::vector<Guard> guards;
  std::unordered_set<NodeId> guarded;  // the conditions of the guards
  LivePartMemory memory;               // for the end of the recording
};

// A set bit in id() marks the negation of the node.  Signs pass through sums, products and quotients without nodes
// of their own.
inline constexpr NodeId kNegated = 0x80000000u;
static_assert(kMostNodes < kNegated);

[[noreturn]] void refuse_sign_of_nan();

template <class Policy>
struct RecordedArithmetic {
  using Value = typename Policy::Value;
  using Base = typename Policy::Base;
  using Tape = typename Policy::Tape;

  static bool is_current(const Value& a) {
    const Tape* const tape = Policy::current();
    return tape && tape->serial == a.tape();
  }

  // The recording of these values, of which at least one is recorded; null: they are constants.
  template <class... Values>
  static Tape* tape_of(const Values&... values) {
    return ((!values.is_recorded() || is_current(values)) && ...) ? Policy::current()
                                                                  : Policy::other(values...);
  }

  static NodeId node(Tape& tape, const Value& a) {
    if (!a.is_recorded() || a.tape() != tape.serial) return Policy::outside(tape, a);
    const NodeId id = a.id() & ~kNegated;
    return id == a.id() ? id : tape.graph.negation(id);
  }

  // The value of a node.  A node that folded to a constant gives a constant, so that comparisons of it need no guard.
  static Value result(Tape& tape, NodeId id, const Base& value) {
    Policy::check(tape);
    if (tape.graph.is_constant(id)) return Value(Base(tape.graph.constant_value(id)));
    const Node& made = tape.graph[id];
    return {value, made.op == Op::Neg ? made.a | kNegated : id, tape.serial};
  }

  template <Op op>
  static Value apply(Value a) {
    if constexpr (op == Op::Neg) return a.is_recorded() ? negation(-a.value(), a) : Value(-a.value());
    const Base value = Policy::template evaluate<op>(a.value(), a.value(), a.value());
    if (!a.is_recorded()) return value;
    Tape* const tape = tape_of(a);
    if (!tape) return value;
    return result(*tape, tape->graph.make(op, node(*tape, a)), value);
  }

  template <Op op>
  static Value apply(Value a, Value b) {
    if constexpr (op == Op::Copysign) {
      if (std::isnan(Policy::number(b)) && Policy::is_constant(a, b)) refuse_sign_of_nan();
    }
    if (!a.is_recorded() && !b.is_recorded())
      return Policy::template evaluate<op>(a.value(), b.value(), b.value());
    if constexpr (Graph::is_arithmetic(op)) {
      if (!a.is_recorded()) return apply_to_constant<op, true>(a, b);
      if (!b.is_recorded()) return apply_to_constant<op, false>(a, b);
      if (is_current(a) && is_current(b)) {
        if (op == Op::Mul && Policy::current()->graph.has_roots()) [[unlikely]]
          return multiply_with_roots(a, b);
        return apply_to_nodes<op>(a, b);
      }
    }
    return apply_by_laws<op>(a, b);
  }

  template <Op op>
  static Value apply(Value a, Value b, Value c) {
    const Base value = Policy::template evaluate<op>(a.value(), b.value(), c.value());
    if (!a.is_recorded() && !b.is_recorded() && !c.is_recorded()) return value;
    Tape* const tape = tape_of(a, b, c);
    if (!tape) return value;
    const NodeId x = node(*tape, a), y = node(*tape, b), z = node(*tape, c);
    return result(*tape, tape->graph.make(op, x, y, z), value);
  }

 private:
  // Each of these functions ends in a call of another, so that values stay in registers.

  [[gnu::noinline]] static Value negation(Base value, Value x) {
    Tape* const tape = tape_of(x);
    if (!tape) return value;
    if (x.id() & kNegated || !Graph::absorbs_negation(tape->graph[x.id()].op))
      return {value, x.id() ^ kNegated, tape->serial};
    return result(*tape, tape->graph.negation(x.id()), value);
  }

  // Both are nodes of the current recording.
  template <Op op>
  [[gnu::always_inline]] static Value apply_to_nodes(Value a, Value b) {
    Tape& tape = *Policy::current();
    const Base value = Policy::template evaluate<op>(a.value(), b.value(), b.value());
    return (a.id() | b.id()) & kNegated ? add_node_of_negations(value, op, a.id(), b.id(), tape)
                                        : add_node<op>(value, a.id(), b.id(), tape);
  }
  [[gnu::noinline]] static Value multiply_with_roots(Value a, Value b) {
    return share_a_root(Policy::current()->graph, a.id() & ~kNegated, b.id() & ~kNegated)
               ? apply_by_laws<Op::Mul>(a, b)
               : apply_to_nodes<Op::Mul>(a, b);
  }

  template <Op op>
  [[gnu::noinline]] static Value apply_by_laws(Value a, Value b) {
    const Base value = Policy::template evaluate<op>(a.value(), b.value(), b.value());
    Tape* const tape = tape_of(a, b);
    if (!tape) return value;
    const NodeId x = node(*tape, a), y = node(*tape, b);
    return result(*tape, tape->graph.make(op, x, y), value);
  }

  template <Op op>
  [[gnu::noinline, gnu::flatten]] static Value add_node(Base value, NodeId a, NodeId b, Tape& tape) {
    const NodeId id = tape.graph.add_new_plain(op, a, b);
    return id != kNoNode ? Value(value, id, tape.serial) : find_or_add_node(value, op, a, b, tape);
  }
  [[gnu::noinline]] static Value find_or_add_node(Base value, Op op, NodeId a, NodeId b, Tape& tape) {
    return {value, tape.graph.make_plain(op, a, b), tape.serial};
  }
  // At least one argument is a negation.
  [[gnu::noinline]] static Value add_node_of_negations(Base value, Op op, NodeId a, NodeId b, Tape& tape) {
    const auto [id, is_negated] = tape.graph.make_signed(op, {a & ~kNegated, (a & kNegated) != 0},
                                                         {b & ~kNegated, (b & kNegated) != 0});
    return {value, is_negated ? id | kNegated : id, tape.serial};
  }
  template <Op op, bool left>
  [[gnu::noinline]] static Value add_node_of_constant(Base value, double c, NodeId x, Tape& tape) {
    const NodeId constant = tape.graph.constant(c);
    return left ? add_node<op>(value, constant, x, tape) : add_node<op>(value, x, constant, tape);
  }

  // One argument is a constant.  Checks for zero and one before asking the graph: most constants of a robot are 0 or
  // 1.
  template <Op op, bool left>
  [[gnu::noinline]] static Value apply_to_constant(Value a, Value b) {
    constexpr std::uint32_t laws = info(op).laws;
    constexpr bool absorbs = laws & (left ? kAbsorbLeft : kAbsorbRight),
                   zero = laws & (left ? kZeroLeft : kZeroRight), one = laws & (left ? kOneLeft : kOneRight);
    const Value& given = left ? a : b;
    const Value& x = left ? b : a;
    if (!is_current(x) || !Policy::is_plain(given)) return apply_by_laws<op>(a, b);
    const double c = Policy::number(given);
    Tape& tape = *Policy::current();
    if (absorbs && c == 0) return Value(Base(0.0));
    const Base value = Policy::template evaluate<op>(a.value(), b.value(), b.value());
    if ((zero && c == 0) || (one && c == 1)) return {value, x.id(), x.tape()};
    if ((op == Op::Sub && left && c == 0) || (op == Op::Mul && c == -1)) return negation(value, x);
    // Other operations with zero, and divisions by a constant, have laws of their own.
    if (c == 0 || (op == Op::Div && !left)) return apply_by_laws<op>(a, b);
    const NodeId id = x.id() & ~kNegated;
    if (id == x.id()) return add_node_of_constant<op, left>(value, c, id, tape);
    if (op == Op::Mul || op == Op::Div) return add_node_of_constant<op, left>(value, -c, id, tape);
    return apply_by_laws<op>(a, b);
  }
};

}  // namespace dyntape::detail
