// SPDX-License-Identifier: BSD-3-Clause
//
// How many lanes processors have, and what a compiler has to be told to use them.
//
//   lane_widths(Lanes::kAll)       {2, 4, 8} on x86-64: SSE2, AVX2, AVX-512; {2} on others
//   lane_widths(Lanes::kNative)    {8} with AVX-512, ...
//   lane_flags(8)                  {"-mavx512f", "-mavx512dq", ...}
//   has_lanes(8)                   whether this processor can run such a kernel
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>

namespace dyntape::codegen {

std::vector<unsigned> lane_widths(Lanes lanes);
std::vector<std::string> lane_flags(unsigned width);
bool has_lanes(unsigned width);

}  // namespace dyntape::codegen
