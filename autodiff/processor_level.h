// SPDX-License-Identifier: BSD-3-Clause
//
// Which processor's code is in use, where the library has several (tools/levels.cmake).
//
//   std::cout << processor_level();       // x86-64-v3
//
// Levels are those of the System V ABI: x86-64-v2 (Nehalem, 2008: SSE4.2), -v3 (Haswell, 2013: AVX2, FMA), -v4 (Skylake-X,
// 2017: AVX-512).  The highest that the processor has is taken when the program is loaded; the environment's
// DYNTAPE_PROCESSOR names a lower one.  Results have the same bits at every level.
//
// Errors end the program before main, with one sentence and status 2: a processor below the lowest level, a name that is
// none, a level that the processor or the build does not have (DYNTAPE_ARCH=here builds one level).
#pragma once

#include <string>

namespace dyntape {

// The level in use; what the library was compiled for (DYNTAPE_ARCH) where it was compiled for one processor.
std::string processor_level();

}  // namespace dyntape
