// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a function and its derivatives for a microcontroller or any program of one's own: plain functions, one
// for each order, without descriptor, heap or anything of the C library but libm.
//
//   EmbeddedOptions how;
//   how.single = true;                                       float instead of double, throughout
//   EmbeddedSource e = generate_embedded(function, options, how);                            // pipeline.h
//   e.source.header      void arm_value(const float x[21], float y[7]);
//                        void arm_first_order(const float x[21], float y[7], float jacobian[98]);
//                        extern const unsigned short arm_jacobian_row[98], arm_jacobian_col[98];
//   e.source.text        C99 that is also C++ and compiles freestanding
//
// Parameters are x, p, w, y, jacobian, hessian, those without entries left out; second order has its weights,
// one an output, behind the function's own in w.  Arrays overlap with nothing.  A function with guards returns
// 0, or 1 + the index of the first violated guard; others return nothing.
//
// Values that live longer than a piece lie in static arrays, so that an entry point must not be entered twice at
// a time; compiled with -DDYNTAPE_WORK= they lie on the stack.  The banner states both, and the stack of every
// entry point: a bound that holds at any optimisation level, and what a compiler made of it (stack_usage.h).
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

// Bytes of stack of each entry point, as a compiler states them.
struct StackUse {
  std::vector<std::size_t> bytes;   // by kernel
  std::vector<std::string> beyond;  // functions of libm, whose own stack comes on top
  std::string with;                 // "arm-none-eabi-gcc 12.2.1 -O2 -mcpu=cortex-m7"
};

struct EmbeddedOptions {
  bool single = false;  // float
  StackUse stack;       // to be stated in the banner; empty: the bound alone
};

struct EmbeddedSource {
  Source source;                          // symbol and pieces are empty
  std::vector<std::string> entries;       // "arm_value", by kernel
  std::vector<std::size_t> stack_bounds;  // bytes, by kernel; 0: calls a kernel written by hand, so unknown
  std::vector<std::size_t> work;          // bytes of static arrays, by kernel
};

// Sine and cosine are printed (own_trig.h), or libm's where sets.functions are; other functions are libm's.  Throws ArgumentError
// if sets.functions are the portable ones, which need a library.
EmbeddedSource print_embedded(const KernelSets& sets, const EmbeddedOptions& options);

}  // namespace dyntape::codegen
