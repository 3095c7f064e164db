// SPDX-License-Identifier: BSD-3-Clause
//
// Products and sums in one instruction, as a decision in the graph: the compiler is never asked to contract.
//
//   x * y + z, x * y - z, z - x * y      ->  fma(x, y, z) and its like, where the product is used by sums only
//   (a * b + c * d) + (e * f + g * h)    ->  ((a * b + c * d) + e * f) + g * h, which leaves one product unfused
//   a kernel that states a fused form    ->  that form (Callee::fused)
//
// x x - y y stays as it is: with one of the squares rounded and the other not it may be negative where x = y.
// A product that several sums use is fused into all of them or none.  A fused node rounds once where two
// operations rounded twice, and everywhere to the same bits; an intermediate product that would overflow does not.
#pragma once

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

// Never more operations than before.  What the first outputs and the guards are made of stays as it is.
Function fused(const Function& function, std::size_t pinned_outputs);

}  // namespace dyntape::codegen
