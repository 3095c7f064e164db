// SPDX-License-Identifier: BSD-3-Clause
//
// Counts all allocations of a program: Eigen and operator new both end in malloc.  For one unit of a program.
#pragma once

#include <atomic>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DYNTAPE_COUNTS_ALLOCATIONS 0  // the sanitizer has put its own functions in their place
#else
#define DYNTAPE_COUNTS_ALLOCATIONS 1

namespace dyntape::test {
inline std::atomic<long> allocations{0};
}

extern "C" {
void* __libc_malloc(std::size_t size) noexcept;
void* malloc(std::size_t size) noexcept {
  ++dyntape::test::allocations;
  return __libc_malloc(size);
}
}
#endif
