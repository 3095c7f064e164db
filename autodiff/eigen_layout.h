// SPDX-License-Identifier: BSD-3-Clause
//
// Checks that a unit uses the Eigen layout of dyntape.  Eigen 3.4 chooses alignment and allocator by the flags of
// each unit, and objects cross units, so all units of a program must agree.  dyntape uses those of a plain build, on
// every processor.
//
//   g++ main.cpp                                              agrees
//   target_link_libraries(main dyntape::dyntape_interface)    agrees: adds no -march
//   target_link_libraries(main dyntape::dyntape_native)       agrees, for the processor of dyntape's build
//   g++ -march=native main.cpp                                disagrees if the processor has AVX: refused here
//   g++ -fsanitize=address main.cpp                           refused by the linker, unless dyntape is built so too
//
// This header includes no other header of dyntape; every part may include it.
#pragma once

#include <Eigen/Core>

static_assert(
    EIGEN_MAX_STATIC_ALIGN_BYTES == 16 && EIGEN_DEFAULT_ALIGN_BYTES == 16,
    "this unit's flags (-march, -mavx or EIGEN_...ALIGN...) give Eigen another layout or allocator than "
    "dyntape's, which are a plain build's: compile it without them, or link dyntape::dyntape_native");

// Defined by the library under a name with its allocator (eigen_layout.cpp).
#if EIGEN_MALLOC_ALREADY_ALIGNED
#define DYNTAPE_ALLOCATOR_OF_EIGEN dyntape_is_not_compiled_with_Eigen_on_malloc_but_this_unit_is
#else
#define DYNTAPE_ALLOCATOR_OF_EIGEN \
  dyntape_is_compiled_with_Eigen_on_malloc_but_this_unit_is_sanitized_or_EIGEN_MALLOC_ALREADY_ALIGNED_is_0
#endif
extern "C" const char DYNTAPE_ALLOCATOR_OF_EIGEN;

namespace dyntape::detail {
[[gnu::used]] static const char* const allocator_of_eigen = &DYNTAPE_ALLOCATOR_OF_EIGEN;
}
