// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a function and its derivatives as self-contained C.
//
//   KernelSets sets = {function, "arm", content_hash(function), Profile::kStrict, plans};
//   Source source = print_c(sets);
//   source.text            C99 that is also C++: no heap, no globals but constant tables, nothing but libm
//   source.pieces          functions that may be compiled apart: -DDYNTAPE_FIRST=3 -DDYNTAPE_LAST=5 compiles
//                          pieces 3 to 5 and declares the others; without them it is one translation unit
//   source.symbol          the exported dyntape_descriptor (abi.h)
//
// Compiled with -DDYNTAPE_LANES=4 (2, 8) the text gives the kernels of that many lanes, arm_value_x4, and no
// descriptor; -DDYNTAPE_X4 where the descriptor is compiled makes it list them (print_lanes.h).
//
// Text and time are linear in the graph.  Numbers are printed exactly, whatever the locale.
#pragma once

#include <string>

#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

Source print_c(const KernelSets& sets);

}  // namespace dyntape::codegen
