// SPDX-License-Identifier: BSD-3-Clause
//
// The open recording of a thread over a base, for recorded.cpp.
#pragma once

#include <cstring>
#include <string>
#include <unordered_map>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/record/tape.h>
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
constinit inline thread_local Tape<Base>* current_tape = nullptr;
template <class Base>
constinit inline thread_local Tape<Base>* quick_tape = nullptr;
template <class Base>
void set_open_tape(std::unique_ptr<Tape<Base>> tape) {
  current_tape<Base> = tape.get();
  quick_tape<Base> = tape && tape->begin.abort_op_index == 0 ? tape.get() : nullptr;
  open_tape<Base>() = std::move(tape);
}

// Numbers on all levels.
template <class Float>
requires std::is_floating_point_v<Float>
double number_of(Float x) { return static_cast<double>(x); }
template <class Base>
double number_of(const AD<Base>& x) {
  return number_of(x.value());
}

template <class Float>
requires std::is_floating_point_v<Float>
bool is_captured(Float) { return false; }
template <class Base>
bool is_captured(const AD<Base>& x) {
  return kind_of(x) != Kind::kConstant || is_captured(x.value());
}

}  // namespace CppAD::inline dyntape_names::detail
