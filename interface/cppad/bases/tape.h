// SPDX-License-Identifier: BSD-3-Clause
//
// The open recording of a thread over a base, for recorded.hxx.
#pragma once

#include <cstring>
#include <string>
#include <unordered_map>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/record/tape.h>
#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/detail/recording.h>

namespace CppAD::inline dyntape_names::detail {

template <class Base>
struct Tape : dyntape::detail::Tape {
  std::vector<Kind> kinds;  // of the nodes that somebody asked for
  std::vector<Base> captured;
  std::unordered_map<std::uint64_t, std::uint32_t> captured_places;  // by tape and node of the base
  struct PrintNodes {
    NodeId flag, value;
    std::string before, after;
  };
  std::vector<PrintNodes> prints;
  Kernels kernels;
  std::unordered_map<NodeId, std::size_t> repeats;  // of guards, by their conditions
  bool is_printed = false;                          // by a CodeHandler: the next recording ends this one
  std::vector<Base> variables, dynamics;
  Begin begin;

  Kind kind(NodeId id);
  NodeId captured_node(const Base& value);
};

template <class Base>
std::unique_ptr<Tape<Base>>& open_tape() {
  thread_local std::unique_ptr<Tape<Base>> tape;
  return tape;
}
// The same at hand; null if there is none.  The quick one is null for recordings of limited length too.
template <class Base>
[[gnu::tls_model("initial-exec")]] constinit inline thread_local Tape<Base>* current_tape = nullptr;
template <class Base>
[[gnu::tls_model("initial-exec")]] constinit inline thread_local Tape<Base>* quick_tape = nullptr;
template <class Base>
void set_open_tape(std::unique_ptr<Tape<Base>> tape) {
  current_tape<Base> = tape.get();
  quick_tape<Base> = tape && tape->begin.abort_op_index == 0 ? tape.get() : nullptr;
  open_tape<Base>() = std::move(tape);
}

std::string begun_at(const Begin& begin);
// Of the nodes up to the last one; those that are there are known.
void find_kinds(const Graph& graph, NodeId last, std::vector<Kind>& kinds);

// Whether a value is no constant of the graph, which has doubles: it is recorded on another level, or has another
// value than each double.  Of a base of the user, only zero and one are.
template <class Base>
bool is_captured(const Base& x) {
  if constexpr (kIsRecorded<Base>) {
    return kind_of(x) != Kind::kConstant || is_captured(x.value());
  } else if constexpr (kIsComplex<Base>) {
    return x.imag() != 0 || std::signbit(x.imag()) || is_captured(x.real());
  } else if constexpr (std::is_floating_point_v<Base>) {
    if constexpr (sizeof(Base) <= sizeof(double)) return false;
    return static_cast<Base>(static_cast<double>(x)) != x && x == x;
  } else {
    return !IdenticalZero(given(x)) && !IdenticalOne(given(x));
  }
}
// The double that it is otherwise.
template <class Base>
double number_of(const Base& x) {
  if constexpr (kIsRecorded<Base>) {
    return number_of(x.value());
  } else if constexpr (kIsComplex<Base>) {
    return static_cast<double>(x.real());
  } else if constexpr (std::is_floating_point_v<Base>) {
    return static_cast<double>(x);
  } else {
    return IdenticalOne(given(x)) ? 1 : 0;
  }
}

}  // namespace CppAD::inline dyntape_names::detail
