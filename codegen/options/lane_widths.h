// SPDX-License-Identifier: BSD-3-Clause
//
// The numbers of SIMD lanes for which kernels are compiled, and the compiler flags for each number.
//
//   lane_widths(Lanes::kAll)       {2, 4, 8} on x86-64 (SSE2, AVX2, AVX-512), {2} on other processors
//   lane_widths(Lanes::kNative)    the widest of this processor: {8} with AVX-512, ...
//   lane_flags(8)                  {"-DDYNTAPE_LANES=8", "-mavx512f", "-mavx512dq", ...}
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
