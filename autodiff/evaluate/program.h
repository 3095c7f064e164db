// SPDX-License-Identifier: BSD-3-Clause
//
// A function compiled for the interpreter: operations, their order and memory slots.
//
//   Program program(function);
//   for (const Program::Run& run : program.runs()) ...        run.count equal operations: one dispatch
//
// It contains only the nodes that outputs and guards need.  A slot is reused when its value is no longer needed, so
// values stay in the first-level cache; constants stay between evaluations.
//
// Equal operators are grouped into runs, within windows of two thousand nodes, since grouping over the whole graph
// would keep many values alive.  The order does not change bits.
//
// Internal to the interpreter (interpret.h).
#pragma once

#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::detail {

class Program {
 public:
  using Word = std::uint32_t;
  static constexpr Word kNoSlot = 0xffffffffu;

  // The kind of a run, and the words of each of its steps in code().
  enum class Kind : std::uint8_t {
    kLoad,     // slot, block, index: an input
    kCompute,  // slot of the result, slots of the arguments
    kCall,     // callee, slots of its arguments, slots of its results (kNoSlot: unused)
    kStore,    // output, slot
    kCheck,    // guard, slot
  };
  struct Run {
    Kind kind;
    Op op;  // of kCompute
    Word count;
  };

  // `function` must be checked (function.h).  All loads come before all stores.
  explicit Program(const Function& function);

  const std::vector<Run>& runs() const { return runs_; }
  const std::vector<Word>& code() const { return code_; }
  std::size_t slots() const { return slots_; }
  // The values of the first slots.
  const std::vector<double>& constants() const { return constants_; }
  const std::vector<std::shared_ptr<const Callee>>& callees() const { return callees_; }
  const std::vector<std::uint8_t>& expected() const { return expected_; }  // expected truth of guard i

 private:
  friend class ProgramLayout;
  std::vector<Run> runs_;
  std::vector<Word> code_;
  std::size_t slots_ = 0;
  std::vector<double> constants_;
  std::vector<std::shared_ptr<const Callee>> callees_;
  std::vector<std::uint8_t> expected_;
};

}  // namespace dyntape::detail
