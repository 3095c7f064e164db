// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/eigen_layout.h>

extern "C" constinit const char DYNTAPE_ALLOCATOR_OF_EIGEN = 0;
