// SPDX-License-Identifier: BSD-3-Clause
//
// A function with the interface by which CasADi calls foreign code, and acados with it: one file of C.
//
//   Source s = generate_casadi(f, blocks, options);                                          pipeline.h
//
//   f = casadi.external('panda_aba', './panda_aba.so')         after  gcc -O1 -shared -fPIC panda_aba.c -o panda_aba.so
//
// Which functions the file has, and of what, is in casadi_functions.h.  Numbers are doubles; several threads may call at a time.  A call
// in which a guard is violated (function.h) returns 1, which CasADi reports as a failed evaluation.
#pragma once

#include <dyntape/codegen/print/casadi_functions.h>
#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

// Throws as casadi_functions().
Source print_casadi(const KernelSets& sets, const CasadiBlocks& blocks);

}  // namespace dyntape::codegen
