// SPDX-License-Identifier: BSD-3-Clause
//
// Recording over a base: what ad.h and recording.h declare.
#pragma once

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/cppad/bases/any_base.h>
#include <dyntape/interface/cppad/bases/tape.h>

namespace CppAD::inline dyntape_names::detail {

constexpr Op op_of(Row row) { return static_cast<Op>(row); }

template <class Base>
bool is_on(const Tape<Base>* tape, const AD<Base>& x) {
  return x.tape() != 0 && tape && x.tape() == tape->serial;
}

template <class Base>
void check_length(const Tape<Base>& tape) {
  if (tape.begin.abort_op_index == 0) return;
  if (tape.graph.size() > tape.begin.abort_op_index) {
    call_handler("Operator index equals abort_op_index in Independent");  // as CppAD documents
    refuse_recording("Independent: operation " + std::to_string(tape.begin.abort_op_index) +
                     ", at which the recording" + begun_at(tape.begin) + " was interrupted, is reached");
  }
}

template <class Base>
NodeId Tape<Base>::captured_node(const Base& value) {
  const auto place = static_cast<std::uint32_t>(captured.size());
  if constexpr (kIsRecorded<Base>) {
    if (value.tape() != 0) {
      const std::uint64_t key = std::uint64_t(value.tape()) << 32 | value.id();
      const auto [known, added] = captured_places.try_emplace(key, place);
      if (!added) return graph.input(Block::kWeights, known->second);
    }
  }
  captured.push_back(value);
  return graph.input(Block::kWeights, place);
}

template <class Base>
Kind Tape<Base>::kind(NodeId id) {
  id &= ~dyntape::detail::kNegated;
  find_kinds(graph, id, kinds);
  return kinds[id];
}

// Values that are not of the open recording are constants; a base that records makes inputs of its own recorded values.
template <class B>
struct Policy {
  using Value = AD<B>;
  using Base = B;
  using Tape = detail::Tape<B>;

  static Tape* current() { return quick_tape<B>; }
  template <class... Values>
  static Tape* other(const Values&... values) {
    Tape* const tape = current_tape<B>;
    return (is_on(tape, values) || ...) ? tape : nullptr;
  }
  static NodeId outside(Tape& tape, const Value& a) {
    return is_captured(a.value()) ? tape.captured_node(a.value()) : tape.graph.constant(number_of(a));
  }
  static bool is_plain(const Value& a) { return !is_captured(a.value()); }
  static double number(const Value& a) { return number_of(a); }
  static bool is_constant(const Value& a, const Value& b) {
    return is_on(current_tape<B>, a) && !is_on(current_tape<B>, b) && is_plain(b);
  }
  template <Op op>
  static Base evaluate(const Base& x, const Base& y, const Base& z) {
    if constexpr (std::is_floating_point_v<Base>) {
      return dyntape::evaluate<op>(x, y, z);
    } else if constexpr (kIsOther<Base>) {
      return evaluate_base<op>(x, y, z);
    } else {
      constexpr auto row = static_cast<Row>(op);
      constexpr int n = info(op).arity;
      if constexpr (n == 1) return apply<row>(x);
      if constexpr (n == 2) return apply<row>(x, y);
      if constexpr (n == 3) return apply<row>(x, y, z);
    }
  }
  static void check(const Tape& tape) { check_length(tape); }
};
template <class Base>
using Arithmetic = dyntape::detail::RecordedArithmetic<Policy<Base>>;

template <class Base>
void guard(Op op, const AD<Base>& x, const AD<Base>& y, bool expected, const char* file, int line) {
  Tape<Base>* const tape = current_tape<Base>;
  if (!is_on(tape, x) && !is_on(tape, y)) return;
  const NodeId a = Arithmetic<Base>::node(*tape, x), b = Arithmetic<Base>::node(*tape, y);
  const NodeId condition = tape->graph.make(op, a, b);
  if (tape->graph.is_constant(condition)) return;
  check_length(*tape);
  if (tape->guarded.contains(condition))
    ++tape->repeats[condition];
  else
    tape->guard(condition, expected, file, line);
}

template <Row row, class Base>
AD<Base> apply(AD<Base> x) {
  if constexpr (std::is_same_v<Base, long double>) {  // the table has slopes with doubles in them
    constexpr Base log_of_2 = 0.693147180559945309417232121458176568L,
                   log_of_10 = 2.302585092994045684017991454684364208L;
    if constexpr (row == Row::Log2) return apply<Row::Log>(x) / AD<Base>(log_of_2);
    if constexpr (row == Row::Log10) return apply<Row::Log>(x) / AD<Base>(log_of_10);
    if constexpr (row == Row::Exp2) return apply<Row::Exp>(x * AD<Base>(log_of_2));
  }
  return Arithmetic<Base>::template apply<op_of(row)>(x);
}
template <Row row, class Base>
AD<Base> apply(AD<Base> x, AD<Base> y) {
  return Arithmetic<Base>::template apply<op_of(row)>(x, y);
}
template <Row row, class Base>
AD<Base> apply(AD<Base> x, AD<Base> y, AD<Base> z) {
  return Arithmetic<Base>::template apply<op_of(row)>(x, y, z);
}

template <class Base>
AD<Base> apply(Row row, const AD<Base>& x, const AD<Base>& y, const AD<Base>& z) {
  (void)y, (void)z;
  switch (row) {
#define OP(name, fn, n, ...) \
  case Row::name:            \
    return apply<Row::name>(DYNTAPE_CPPAD_ARGUMENTS_##n);
#define DYNTAPE_CPPAD_ARGUMENTS_1 x
#define DYNTAPE_CPPAD_ARGUMENTS_2 x, y
#define DYNTAPE_CPPAD_ARGUMENTS_3 x, y, z
#include <dyntape/autodiff/graph/ops.def>
  }
  __builtin_unreachable();
}

template <class Base>
bool compare_base(Row row, const Base& x, const Base& y) {
  if (row == Row::Eq) return x == y;
  if (row == Row::Ne) return x != y;
  if constexpr (kIsComplex<Base>) {
    refuse_order_of_complex("a comparison");
  } else if constexpr (requires { x < y, x <= y; }) {
    return row == Row::Lt ? x < y : x <= y;
  } else {
    refuse_missing("operator <");
  }
}

template <class Base>
bool compare(Row row, const AD<Base>& x, const AD<Base>& y, const char* file, int line) {
  const Op op = op_of(row);
  bool truth;
  if constexpr (std::is_floating_point_v<Base>) {
    truth = evaluate<Base>(op, x.value(), y.value(), y.value()) != 0;
  } else if constexpr (kIsRecorded<Base>) {
    truth = compare(row, x.value(), y.value(), file, line);
  } else {
    truth = compare_base(row, x.value(), y.value());
  }
  if (const Tape<Base>* const tape = current_tape<Base>; tape && tape->begin.record_compare)
    guard(op, x, y, truth, file, line);
  return truth;
}

template <class Base>
void record_guard(Row row, const AD<Base>& x, const AD<Base>& y) {
  guard(op_of(row), x, y, true, "graph", 0);
}

template <class Base>
Kind kind_of(const AD<Base>& x) {
  if (x.tape() == 0) return Kind::kConstant;
  Tape<Base>* const tape = current_tape<Base>;
  return is_on(tape, x) ? tape->kind(x.id()) : Kind::kConstant;
}

template <class Base>
const Base& value_to_keep(const AD<Base>& x) {
  if (kind_of(x) == Kind::kVariable) {
    refuse_recording(
        "Value: the argument is a variable of the recording" + begun_at(open_tape<Base>()->begin) +
        " which is open, and its value would be a constant of it; Var2Par says that this is meant");
  }
  return x.value();
}

template <class Base>
bool is_recording() {
  return current_tape<Base> != nullptr;
}

template <class Base>
void begin_recording(AD<Base>* x, std::size_t n_x, AD<Base>* dynamic, std::size_t n_dynamic,
                     const Begin& begin) {
  if (n_x == 0) refuse("Independent: there are no independent variables, expected at least one");
  if (open_tape<Base>() && open_tape<Base>()->is_printed) set_open_tape<Base>(nullptr);
  if (const auto& open = open_tape<Base>())
    refuse_recording(
        "Independent: a recording of this thread" + begun_at(open->begin) +
        " is open over the same base; end it by ADFun, Dependent or AD<Base>::abort_recording()");
  auto tape = std::make_unique<Tape<Base>>();
  tape->begin = begin;
  const auto declare = [&](Block block, AD<Base>* values, std::size_t n, std::vector<Base>& kept) {
    for (std::size_t i = 0; i < n; ++i) {
      kept.push_back(values[i].value());
      values[i] =
          AD<Base>(values[i].value(), tape->graph.input(block, static_cast<std::uint32_t>(i)), tape->serial);
    }
  };
  declare(Block::kVariables, x, n_x, tape->variables);
  declare(Block::kParameters, dynamic, n_dynamic, tape->dynamics);
  set_open_tape(std::move(tape));
}

template <class Base>
void record_print(const AD<Base>& flag, const std::string& before, const AD<Base>& value,
                  const std::string& after) {
  Tape<Base>* const tape = current_tape<Base>;
  if (!tape) return;
  const NodeId of_flag = Arithmetic<Base>::node(*tape, flag), of_value = Arithmetic<Base>::node(*tape, value);
  tape->prints.push_back({of_flag, of_value, before, after});
}

template <class Base>
std::vector<AD<Base>> record_call(const std::shared_ptr<const Callee>& callee,
                                  const std::shared_ptr<const KernelInSeries>& kernel,
                                  const std::vector<AD<Base>>& arguments, const std::vector<Base>& values) {
  std::vector<AD<Base>> results(values.begin(), values.end());
  Tape<Base>* const tape = current_tape<Base>;
  bool any = false;
  for (const AD<Base>& a : arguments) any = any || is_on(tape, a);
  if (!any) return results;
  std::vector<NodeId> nodes;
  for (const AD<Base>& a : arguments) nodes.push_back(Arithmetic<Base>::node(*tape, a));
  const std::vector<NodeId> made = tape->graph.call(callee, nodes);
  if (kernel) tape->kernels[callee.get()] = kernel;
  for (std::size_t i = 0; i < made.size(); ++i)
    results[i] = Arithmetic<Base>::result(*tape, made[i], values[i]);
  return results;
}

template <class Base>
void check_independents(const Tape<Base>& tape, const AD<Base>* x, std::size_t n_x) {
  if (n_x != tape.variables.size())
    refuse("ADFun: x has " + std::to_string(n_x) + " entries, Independent had " +
           std::to_string(tape.variables.size()));
  for (std::size_t i = 0; i < n_x; ++i) {
    const bool is_node = x[i].tape() == tape.serial && !(x[i].id() & dyntape::detail::kNegated);
    if (is_node && tape.graph[x[i].id()] == Node{Op::Input, 0, NodeId(i), kNoNode}) continue;
    refuse("ADFun: x[" + std::to_string(i) +
           "] is not the independent variable that Independent made of it: it has been assigned since");
  }
}

// The recording with these results; the tape stays open.
template <class Base>
std::shared_ptr<const Recording<Base>> recording_of(Tape<Base>& tape, const AD<Base>* y, std::size_t n_y) {
  if (n_y == 0) refuse("ADFun: there are no dependent variables, expected at least one");
  auto recording = std::make_shared<Recording<Base>>();
  std::vector<NodeId> outputs;
  for (std::size_t i = 0; i < n_y; ++i) outputs.push_back(Arithmetic<Base>::node(tape, y[i]));
  for (const auto& print : tape.prints) {
    recording->prints.push_back({outputs.size(), outputs.size() + 1, print.before, print.after});
    outputs.insert(outputs.end(), {print.flag, print.value});
  }
  Function function = live_part(tape.graph, outputs, tape.guards, std::move(tape.memory));  // with all guards
  function.name = "cppad";
  function.inputs = {tape.variables.size(), tape.dynamics.size(), tape.captured.size()};
  recording->function = std::make_shared<const Function>(std::move(function));
  recording->range = n_y;
  for (const Guard& guard : tape.guards) {
    recording->guard_places.push_back(guard.condition);
    const auto repeats = tape.repeats.find(guard.condition);
    recording->guard_counts.push_back(repeats == tape.repeats.end() ? 1 : 1 + repeats->second);
  }
  recording->kernels = tape.kernels;
  recording->captured = tape.captured;
  recording->variables = tape.variables;
  recording->dynamics = tape.dynamics;
  return recording;
}

template <class Base>
std::shared_ptr<const Recording<Base>> end_recording(const AD<Base>* x, std::size_t n_x, const AD<Base>* y,
                                                     std::size_t n_y) {
  auto& open = open_tape<Base>();
  if (!open) refuse_recording("ADFun: this thread has no recording open; Independent begins one");
  if (x) check_independents(*open, x, n_x);
  const std::unique_ptr<Tape<Base>> tape = std::move(open);
  set_open_tape<Base>(nullptr);
  return recording_of(*tape, y, n_y);
}

template <class Base>
std::shared_ptr<const Recording<Base>> recorded_so_far(const AD<Base>* y, std::size_t n_y) {
  auto& open = open_tape<Base>();
  if (!open) refuse_recording("CodeHandler: this thread has no recording open; makeVariables begins one");
  open->is_printed = true;
  return recording_of(*open, y, n_y);
}

template <class Base>
std::uint32_t open_recording() {
  return open_tape<Base>() ? open_tape<Base>()->serial : 0;
}

template <class Base>
std::shared_ptr<const Recording<double>> recording_of_numbers(const Recording<Base>& of, const char* who) {
  if (!of.captured.empty())
    refuse(std::string(who) + ": the function was recorded with values of another recording");
  const auto numbers = [](const std::vector<Base>& values) {
    std::vector<double> result;
    for (const Base& value : values) result.push_back(number_of(value));
    return result;
  };
  return std::make_shared<const Recording<double>>(Recording<double>{of.function,
                                                                     of.range,
                                                                     of.prints,
                                                                     of.guard_places,
                                                                     of.guard_counts,
                                                                     of.kernels,
                                                                     {},
                                                                     numbers(of.variables),
                                                                     numbers(of.dynamics)});
}

}  // namespace CppAD::inline dyntape_names::detail

namespace CppAD::inline dyntape_names {

template <class Base>
void AD<Base>::abort_recording() {
  detail::set_open_tape<Base>(nullptr);
}

}  // namespace CppAD::inline dyntape_names
