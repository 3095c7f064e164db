// SPDX-License-Identifier: BSD-3-Clause
//
// A function laid out for the interpreter: which operations, in which order, on which slots of memory.
//
//   Program program(function);
//   for (const Program::Run& run : program.runs()) ...        run.count times the same operation: one decision
//
// Only what outputs and guards need is there.  A slot is used again once its value is not needed any more, so
// that values stay in the nearest cache; constants keep theirs from one evaluation to the next.
//
// Operations of one kind are gathered into runs.  To look for company all over the graph would keep many
// values alive, so that is done within windows of two thousand.  The order changes no bit.
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

  // What a run does, and the words that each of its steps has in code().
  enum class Kind : std::uint8_t {
    kLoad,     // slot, block, index: an input
    kCompute,  // slot of the result, slots of the arguments
    kCall,     // callee, slots of its arguments, slots of its results (kNoSlot: nobody needs it)
    kStore,    // output, slot
    kCheck,    // guard, slot
  };
  struct Run {
    Kind kind;
    Op op;  // of kCompute
    Word count;
  };

  // The function has been checked (function.h).  Every load comes before every store.
  explicit Program(const Function& function);

  const std::vector<Run>& runs() const { return runs_; }
  const std::vector<Word>& code() const { return code_; }
  std::size_t slots() const { return slots_; }
  // The values of the first slots.
  const std::vector<double>& constants() const { return constants_; }
  const std::vector<std::shared_ptr<const Callee>>& callees() const { return callees_; }
  const std::vector<std::uint8_t>& expected() const { return expected_; }  // truth of guard i

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
