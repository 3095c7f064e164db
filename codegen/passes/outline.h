// SPDX-License-Identifier: BSD-3-Clause
//
// Makes one function of repeated parts of a function (repeats.h), called once for each part.
//
//   Function shorter = outlined(function);      four legs: a function of a leg, four calls, and the rest
//
// Large kernels are limited by instruction fetch; a part that exists once stays in the cache.  The differences
// between the parts, inputs and some constants, become arguments.  No operation is added, removed or changed:
// results have the same bits.
//
// Returns the function unchanged if outlining does not pay: short functions, and functions with few repeated
// statements.
#pragma once

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

Function outlined(const Function& function);

}  // namespace dyntape::codegen
