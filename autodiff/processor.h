// SPDX-License-Identifier: BSD-3-Clause
//
// Macros for the processor features that a unit is compiled for.
//
//   #if defined(DYNTAPE_HAS_AVX)        // 256-bit registers
//
// dyntape_native compiles for one processor, and each level of the library for its own (tools/levels.cmake).  Both
// hide the compiler's macros of the same name, by which Eigen would choose another layout and allocator
// (eigen_layout.h), and define macros with the prefix DYNTAPE instead.
//
// Vectors are passed in registers if the processor has them, else in memory.  Types that hold vectors are in an
// inline namespace named after this choice.  So units for different processors never link each other's functions;
// the linker reports a missing one by a name that explains the problem.
//
// This header includes no other header of dyntape; every part may include it.
#pragma once

#if defined(__AVX512F__) || defined(DYNTAPE__AVX512F__)
#define DYNTAPE_HAS_AVX512F 1
#endif
#if defined(__AVX__) || defined(DYNTAPE__AVX__)
#define DYNTAPE_HAS_AVX 1
#endif
#if defined(__FMA__) || defined(DYNTAPE__FMA__)
#define DYNTAPE_HAS_FMA 1
#endif

// DYNTAPE_REGISTER: bytes of a vector register.  For gcc 12 a wider vector type is an object in memory, stored and
// read again between any two operations.
#if defined(DYNTAPE_HAS_AVX512F)
#define DYNTAPE_REGISTER 64
#define DYNTAPE_VECTORS vectors_of_64_bytes_as_units_linked_to_dyntape_native
#elif defined(DYNTAPE_HAS_AVX)
#define DYNTAPE_REGISTER 32
#define DYNTAPE_VECTORS vectors_of_32_bytes_as_units_linked_to_dyntape_native
#else
#define DYNTAPE_REGISTER 16
#define DYNTAPE_VECTORS vectors_of_16_bytes_unless_linked_to_dyntape_native
#endif
