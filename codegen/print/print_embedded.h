// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a function and its derivatives for microcontrollers: plain functions, one per order, without descriptor,
// heap or libraries except libm.
//
//   EmbeddedOptions how;
//   how.single = true;                                       float instead of double, throughout
//   EmbeddedSource e = generate_embedded(function, options, how);                            // pipeline.h
//   e.source.header      void arm_value(const float x[21], float y[7]);
//                        void arm_first_order(const float x[21], float y[7], float jacobian[98]);
//                        extern const unsigned short arm_jacobian_row[98], arm_jacobian_col[98];
//   e.source.text        C99 that is also C++ and compiles freestanding
//
// Parameters are x, p, w, y, jacobian, hessian, without empty ones.  In second order the Hessian's weights, one per
// output, follow the function's own in w.  Arrays must not overlap.  A function with guards returns 0, or 1 + the
// index of the first violated guard; others return nothing.
//
// Values that live longer than a piece are in static arrays, so an entry point is not reentrant.  With
// -DDYNTAPE_WORK= they are on the stack.  The banner states the size of both, and the stack of every entry point: a
// bound for any optimisation level, and the value from a compiler (stack_usage.h).
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

// Bytes of stack of each entry point, from a compiler.
struct StackUse {
  std::vector<std::size_t> bytes;   // by kernel
  std::vector<std::string> beyond;  // functions of libm, whose stack is additional
  std::string with;                 // "arm-none-eabi-gcc 12.2.1 -O2 -mcpu=cortex-m7"
};

struct EmbeddedOptions {
  bool single = false;  // float
  StackUse stack;       // for the banner; empty: the bound only
  // Names of the kernels, which may be of several functions.  If given, they are static functions for another text that
  // includes source.text: no banner, no header, no tables of non-zeros, and work arrays on the stack.
  std::vector<std::string> parts = {};
};

struct EmbeddedSource {
  Source source;                     // symbol and pieces are empty
  std::vector<std::string> entries;  // "arm_value", by kernel
  std::vector<std::size_t>
      stack_bounds;                     // bytes, by kernel; 0: unknown, since it calls a hand-written kernel
  std::vector<std::size_t> work;        // bytes of static arrays, by kernel
  std::vector<std::string> calls = {};  // functions of libm in the text: "sqrt", "atan2"
};

// Sine and cosine are printed (own_trig.h), or libm's where sets.functions are; other functions are libm's.  Throws ArgumentError
// if sets.functions are the portable ones, which need a library.
EmbeddedSource print_embedded(const KernelSets& sets, const EmbeddedOptions& options);

}  // namespace dyntape::codegen
