// SPDX-License-Identifier: BSD-3-Clause
//
// How machine code calls a callee: a recorded one by its own kernel, one written by hand without letting an exception through.
//
//   CalleeFunction* const f = callee_function(called, 8);
//   f(&called, in, out, work);                       // in, out: 8 lanes an entry; work: work_of(called) doubles
//   rethrow_thrown();                                // behind the evaluation
#pragma once

#include <cstddef>

#include <dyntape/codegen/machine/machine_kernel.h>

namespace dyntape::codegen {

CalleeFunction* callee_function(const CalleeOfKernel& called, int lanes);
std::size_t work_of(const CalleeOfKernel& called);

// What a callee written by hand threw in this thread's last evaluation.
void rethrow_thrown();

}  // namespace dyntape::codegen
