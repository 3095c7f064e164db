// SPDX-License-Identifier: BSD-3-Clause
//
// A kernel of machine code, and what its instructions refer to.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/codegen/machine/encoder.h>
#include <dyntape/codegen/run/lanes.h>

namespace dyntape::codegen {

struct MachineKernel;

// The kernels of recorded callees, each once.
using CalledKernels = std::map<const Callee*, std::shared_ptr<MachineKernel>>;

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
  std::vector<std::uint8_t> instructions;  // of any place
  dyntape_kernel kernel = {};

  void run_at(std::span<const std::uint8_t> place) {
    kernel.run = reinterpret_cast<dyntape_run>(reinterpret_cast<std::uintptr_t>(place.data()));
  }
};

}  // namespace dyntape::codegen
