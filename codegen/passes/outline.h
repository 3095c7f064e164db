// SPDX-License-Identifier: BSD-3-Clause
//
// Repeated parts of a function (repeats.h) as one function that is called for each of them.
//
//   Function shorter = outlined(function);      four legs: a leg, four calls of it, and what holds them together
//
// Large kernels are limited by instruction fetch, and a part that is there once stays in the cache.  What
// differs from part to part, the inputs and some constants, becomes an argument.  No operation is added, left out
// or changed: results have the same bits.
//
// The function comes back as it is where this would not pay: short ones, and those with few repeated statements.
#pragma once

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

Function outlined(const Function& function);

}  // namespace dyntape::codegen
