// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a function as one C file with CasADi's interface for external functions, which acados uses too.
//
//   Source s = generate_casadi(f, blocks, options);                                          pipeline.h
//
//   f = casadi.external('panda_aba', './panda_aba.so')         after gcc -O1 -shared -fPIC panda_aba.c -o panda_aba.so
//
// casadi_functions.h lists the functions of the file.  Numbers are doubles; several threads may call at a time.  If
// a guard is violated (function.h), a call returns 1, which CasADi reports as a failed evaluation.
#pragma once

#include <dyntape/codegen/print/casadi_functions.h>
#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

// Throws as casadi_functions().
Source print_casadi(const KernelSets& sets, const CasadiBlocks& blocks);

}  // namespace dyntape::codegen
