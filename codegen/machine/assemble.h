// SPDX-License-Identifier: BSD-3-Clause
//
// From a graph to instructions: which value stands where, and when it moves.
//
//   CalledKernels called;
//   const auto kernel = assemble(derived, 8, Functions::kLibm, called);       // of 8 lanes
//   kernel->kernel.run(...)
//
// Where a register is needed and none is free, the value that is needed last makes room (L. Belady, A study of replacement
// algorithms for a virtual-storage computer, IBM Systems Journal 5(2), 1966): of a function without loops all uses are known.
#pragma once

#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/scalars/portable.h>
#include <dyntape/codegen/machine/encoder.h>
#include <dyntape/codegen/machine/executable_memory.h>
#include <dyntape/codegen/run/lanes.h>

namespace dyntape::codegen {

struct MachineKernel;

// The kernels of recorded callees, each once.
using CalledKernels = std::map<const Callee*, std::shared_ptr<const MachineKernel>>;

// A callee, as machine code calls it.
struct CalleeOfKernel {
  std::shared_ptr<const Callee> callee;
  std::shared_ptr<const MachineKernel> kernel;  // null: it is written by hand
};

// All that its instructions refer to.
struct MachineKernel {
  AlignedRoom pool;
  GuardTable guards;
  std::vector<CalleeOfKernel> called;
  std::optional<ExecutableMemory> memory;
  dyntape_kernel kernel = {};
};

// What a callee written by hand threw in this thread's last evaluation; null: nothing.
std::exception_ptr take_thrown();

std::shared_ptr<const MachineKernel> assemble(const Derivatives& derived, int lanes, Functions functions,
                                              CalledKernels& known);

}  // namespace dyntape::codegen
