// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/float128.h>
#include <dyntape/dynamics/instantiate.h>

DYNTAPE_INSTANTIATE_DYNAMICS(dyntape::dynamics::Float128)
