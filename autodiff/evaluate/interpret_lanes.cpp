// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/evaluate/interpret_lanes.h>

#include <algorithm>
#include <memory>

#include <dyntape/autodiff/graph/callee.h>

namespace dyntape::detail {
namespace {

using Word = Program::Word;

template <int N>
double* lanes_at(double* values, Word slot) {
  return static_cast<double*>(__builtin_assume_aligned(values + std::size_t{slot} * N, 8 * N));
}

// A run of one operation.  Arguments are read before the result is written: it may have the slot of one.
template <Op op, int N>
const Word* compute(Functions functions, const Word* code, Word count, double* values) {
  constexpr int arity = info(op).arity;
  for (; count > 0; --count, code += arity + 1) {
    const double* const a = lanes_at<N>(values, code[1]);
    const double* const b = arity > 1 ? lanes_at<N>(values, code[2]) : a;
    const double* const c = arity > 2 ? lanes_at<N>(values, code[3]) : a;
    double result[N];
    if (N == 1 && is_turn(op) && is_portable(op, functions)) {
      result[0] = evaluate<op, double>(a[0], b[0], c[0]);
    } else if (is_portable(op, functions)) {
      portable_values(op, a, b, result, N);
    } else {
#pragma GCC unroll 1  // not before it is vectorised
      for (int l = 0; l < N; ++l) result[l] = evaluate_by_libm<op>(a[l], b[l], c[l]);
    }
    std::copy_n(result, N, lanes_at<N>(values, code[0]));
  }
  return code;
}

template <int N>
const Word* compute(Functions functions, const Program::Run& step, const Word* code, double* values) {
  switch (step.op) {
#define OP(name, ...) \
  case Op::name:      \
    return compute<Op::name, N>(functions, code, step.count, values);
#include <dyntape/autodiff/graph/ops.def>
    default:
      return code;
  }
}

// Lanes beyond the last repeat it: what they compute is harmless and not stored.
template <int N>
const Word* load(const Word* code, Word count, const LaneView<const double>* inputs, int lanes,
                 double* values) {
  for (; count > 0; --count, code += 3) {
    const LaneView<const double>& from = inputs[code[1]];
    const double* const entry = from.data + code[2] * from.entry;
    double* const to = lanes_at<N>(values, code[0]);
    for (int l = 0; l < N; ++l) to[l] = entry[static_cast<std::size_t>(std::min(l, lanes - 1)) * from.lane];
  }
  return code;
}

template <int N>
const Word* store(const Word* code, Word count, const LaneView<double>& to, int lanes, double* values) {
  for (; count > 0; --count, code += 2) {
    double* const entry = to.data + code[0] * to.entry;
    const double* const from = lanes_at<N>(values, code[1]);
    for (int l = 0; l < lanes; ++l) entry[static_cast<std::size_t>(l) * to.lane] = from[l];
  }
  return code;
}

template <int N>
const Word* check(const Word* code, Word count, const Program& program, int lanes, double* values,
                  std::uint32_t* status) {
  for (; count > 0; --count, code += 2) {
    const double* const condition = lanes_at<N>(values, code[1]);
    for (int l = 0; l < lanes; ++l) {
      const bool holds = (condition[l] != 0) == (program.expected()[code[0]] != 0);
      if (!holds && (status[l] == 0 || code[0] + 1 < status[l])) status[l] = code[0] + 1;
    }
  }
  return code;
}

// A kernel written by hand takes one lane at a time, where it does not say otherwise.
template <int N>
void call_kernel(const Callee& callee, LaneRoom<N>& room) {
  if (callee.kernel()->evaluate_lanes) {
    double* const all = room.call.data()->lane;
    return callee.kernel()->evaluate_lanes(all, all + callee.n_in * N, N);
  }
  double* const in = room.one.data();
  double* const out = in + callee.n_in;
  for (int l = 0; l < N; ++l) {
    for (std::size_t i = 0; i < callee.n_in; ++i) in[i] = room.call[i].lane[l];
    callee.kernel()->evaluate(in, out);
    for (std::size_t i = 0; i < callee.n_out; ++i) room.call[callee.n_in + i].lane[l] = out[i];
  }
}

template <int N>
const Word* call(Functions functions, const Word* code, Word count,
                 const std::vector<LinkedProgram>& programs, std::size_t which,
                 std::vector<LaneRoom<N>>& rooms) {
  LaneRoom<N>& room = rooms[which];
  for (; count > 0; --count) {
    const Callee& callee = *programs[which].program.callees()[*code];
    const std::size_t called = programs[which].callees[*code];
    ++code;
    for (std::size_t i = 0; i < callee.n_in; ++i) room.call[i] = room.values[*code++];
    if (called == LinkedProgram::kKernel) {
      call_kernel(callee, room);
    } else {  // recorded: without parameters, weights and guards
      double* const space = room.call.data()->lane;
      const LaneView<const double> in[kBlocks] = {{space, N, 1}, {}, {}};
      std::uint32_t status[N];
      run<N>(functions, programs, called, in, {space + callee.n_in * N, N, 1}, rooms, N, status);
    }
    for (std::size_t i = 0; i < callee.n_out; ++i, ++code) {
      if (*code != Program::kNoSlot) room.values[*code] = room.call[callee.n_in + i];
    }
  }
  return code;
}

}  // namespace

template <int N>
LaneRoom<N>::LaneRoom(const LinkedProgram& linked)
    : values(linked.program.slots()), call(linked.call_space), one(linked.call_space) {
  const std::vector<double>& constants = linked.program.constants();
  for (std::size_t i = 0; i < constants.size(); ++i) std::fill_n(values[i].lane, N, constants[i]);
}

template <int N>
void run(Functions functions, const std::vector<LinkedProgram>& programs, std::size_t which,
         const LaneView<const double>* inputs, const LaneView<double>& outputs,
         std::vector<LaneRoom<N>>& rooms, int lanes, std::uint32_t* status) {
  const Program& program = programs[which].program;
  double* const values = rooms[which].values.empty() ? nullptr : rooms[which].values[0].lane;
  std::fill_n(status, lanes, 0u);
  const Word* code = program.code().data();
  for (const Program::Run& step : program.runs()) {
    switch (step.kind) {
      case Program::Kind::kCompute:
        code = compute<N>(functions, step, code, values);
        break;
      case Program::Kind::kLoad:
        code = load<N>(code, step.count, inputs, lanes, values);
        break;
      case Program::Kind::kStore:
        code = store<N>(code, step.count, outputs, lanes, values);
        break;
      case Program::Kind::kCheck:
        code = check<N>(code, step.count, program, lanes, values, status);
        break;
      case Program::Kind::kCall:
        code = call<N>(functions, code, step.count, programs, which, rooms);
        break;
    }
  }
}

#define DYNTAPE_INSTANTIATE(N)                                                                            \
  template struct LaneRoom<N>;                                                                            \
  template void run<N>(Functions, const std::vector<LinkedProgram>&, std::size_t,                         \
                       const LaneView<const double>*, const LaneView<double>&, std::vector<LaneRoom<N>>&, \
                       int, std::uint32_t*);
DYNTAPE_INSTANTIATE(1)
DYNTAPE_INSTANTIATE(kLanes)

}  // namespace dyntape::detail
