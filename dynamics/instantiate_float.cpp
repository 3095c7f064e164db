// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/instantiate.h>

DYNTAPE_INSTANTIATE_DYNAMICS(float)
