// SPDX-License-Identifier: BSD-3-Clause
//
// A function as machine code, made in this process: what a compiled library is, some milliseconds later.
//
//   const auto code = MachineCode::make(derived, options);       // by order; Unavailable where the system or the processor forbids it
//   code->descriptor().kernels[0].run(x, p, w, y, nullptr, nullptr, work, 1, nullptr, &status);
//
// One pass over each graph: a value stands in a register until others are needed sooner, then in the work array.  An operator is
// an instruction, or a call of the function by which the interpreter evaluates it, so that the bits are the interpreter's.
// What a callee written by hand throws arrives when the evaluation has ended, which calls none of them from then on and leaves NaN;
// so a thread is not to be cancelled there.  With DYNTAPE_PERF_MAP set, /tmp/perf-PID.map names its kernels, as `perf report` wants it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/store/abi.h>

namespace dyntape::codegen {

struct MachineKernel;
class ExecutableMemory;

class MachineCode {
 public:
  // Whether this processor has an encoder (encoder.h).
  static bool is_possible();

  static std::shared_ptr<const MachineCode> make(const std::vector<Derivatives>& derived,
                                                 const CodegenOptions& options);
  ~MachineCode();
  MachineCode(const MachineCode&) = delete;
  MachineCode& operator=(const MachineCode&) = delete;

  // The instructions of each kernel of the descriptor, then of those that they call.
  std::vector<std::span<const std::uint8_t>> instructions() const;

  // Patterns and kernels; nothing else of it is set.
  const dyntape_descriptor& descriptor() const { return descriptor_; }

 private:
  explicit MachineCode(const Derivatives& highest);
  void place();  // all kernels in memory
  Pattern jacobian_, hessian_;
  std::vector<std::shared_ptr<MachineKernel>> made_;  // those of the descriptor, then those that they call
  std::unique_ptr<const ExecutableMemory> memory_;
  std::vector<dyntape_kernel> kernels_;
  dyntape_descriptor descriptor_ = {};
};

}  // namespace dyntape::codegen
