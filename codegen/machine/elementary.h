// SPDX-License-Identifier: BSD-3-Clause
//
// The functions that machine code calls.  The interpreter calls the same ones, so both have the same bits.
#pragma once

#include <dyntape/autodiff/scalars/portable.h>
#include <dyntape/codegen/machine/encoder.h>

namespace dyntape::codegen {

// In registers; null: there is none, and lane_function(op, 1, functions) serves.
ScalarFunction* scalar_function(Op op, Functions functions);
LaneFunction* lane_function(Op op, int lanes, Functions functions);  // `op`: of the table, here and above

// Sine and cosine of x together: result[0, lanes) and result[lanes, 2 lanes).
LaneFunction* sine_and_cosine(int lanes, Functions functions);

}  // namespace dyntape::codegen
