// SPDX-License-Identifier: BSD-3-Clause
//
// From a graph to instructions: which value stands where, and when it moves.
//
//   CalledKernels called;
//   const auto kernel = assemble(derived, 8, options, called);     // of 8 lanes
//   ExecutableMemory memory({kernel->instructions, ...});          // and of those in `called`
//   kernel->run_at(memory.code(0));
//   kernel->kernel.run(...)
//
// Where a register is needed and none is free, the value that is needed last makes room (L. Belady, A study of replacement
// algorithms for a virtual-storage computer, IBM Systems Journal 5(2), 1966): of a function without loops all uses are known.
#pragma once

#include <memory>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/codegen/machine/machine_kernel.h>
#include <dyntape/codegen/options/options.h>

namespace dyntape::codegen {

// Unavailable for what is too long; ToolError once options.stop is asked for.
std::shared_ptr<MachineKernel> assemble(const Derivatives& derived, int lanes, const CodegenOptions& options,
                                        CalledKernels& known);

}  // namespace dyntape::codegen
