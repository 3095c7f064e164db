// SPDX-License-Identifier: BSD-3-Clause
//
// The algorithms of dynamics/ for the recording scalar: here, where the two meet.
#include <dyntape/autodiff/eigen.h>
#include <dyntape/dynamics/instantiate.h>

DYNTAPE_INSTANTIATE_DYNAMICS(dyntape::AD)
