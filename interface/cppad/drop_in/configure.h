// SPDX-License-Identifier: BSD-3-Clause
//
// The macros of <cppad/configure.hpp>, for programs that ask them what CppAD was built with.
#pragma once

#define CPPAD_PACKAGE_STRING "cppad-dyntape"
#define CPPAD_USE_CPLUSPLUS_2011 1
#define CPPAD_USE_CPLUSPLUS_2017 1
#define CPPAD_DEBUG_AND_RELEASE 1
#define CPPAD_DEPRECATED 0
#define CPPAD_NULL nullptr
#define CPPAD_NOEXCEPT noexcept
#define CPPAD_NDEBUG_NOEXCEPT

// Which vector CPPAD_TESTVECTOR is.
#define CPPAD_CPPADVECTOR 1
#define CPPAD_STDVECTOR 0
#define CPPAD_BOOSTVECTOR 0
#define CPPAD_EIGENVECTOR 0

// Packages that CppAD calls.
#define CPPAD_HAS_ADOLC 0
#define CPPAD_HAS_COLPACK 0
#ifndef CPPAD_HAS_IPOPT
#define CPPAD_HAS_IPOPT 0  // 1 for programs that link dyntape::cppad_ipopt
#endif
#if __has_include(<Eigen/Core>)
#define CPPAD_HAS_EIGEN 1
#else
#define CPPAD_HAS_EIGEN 0
#endif

// Indices of a recording are 32 bits wide; as many threads may record as there are.
#define CPPAD_TAPE_ADDR_TYPE unsigned int
#define CPPAD_TAPE_ID_TYPE unsigned int
#define CPPAD_IS_SAME_TAPE_ADDR_TYPE_SIZE_T 0
#define CPPAD_IS_SAME_UNSIGNED_INT_SIZE_T 0
#ifndef CPPAD_MAX_NUM_THREADS
#define CPPAD_MAX_NUM_THREADS 48
#endif
