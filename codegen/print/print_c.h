// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a function and its derivatives as self-contained C.
//
//   KernelSets sets = {function, "arm", content_hash(function), plans};
//   Source source = print_c(sets);
//   source.text            C99 and C++: no heap, no globals except constant tables, no library except libm
//   source.pieces          functions for separate compilation: -DDYNTAPE_FIRST=3 -DDYNTAPE_LAST=5 compiles pieces 3
//                          to 5 and declares the others; without them the text is one translation unit
//   source.symbol          the exported dyntape_descriptor (abi.h)
//
// Compiled with -DDYNTAPE_LANES=4 (2, 8) the text gives the kernels for this number of lanes, arm_value_x4, without
// descriptor.  -DDYNTAPE_X4 adds them to the descriptor (print_lanes.h).
//
// Length and time are linear in the graph.  Numbers are printed exactly, independent of the locale.
#pragma once

#include <string>

#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

Source print_c(const KernelSets& sets);

}  // namespace dyntape::codegen
