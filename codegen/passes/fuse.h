// SPDX-License-Identifier: BSD-3-Clause
//
// Products and sums in one instruction, as a decision in the graph: the compiler is never asked to contract.
//
//   x * y + z, x * y - z, z - x * y      ->  fma(x, y, z) and its like, where the product is used by sums only
//   (a * b + c * d) + (e * f + g * h)    ->  ((a * b + c * d) + e * f) + g * h, which leaves one product unfused
//   a kernel that states a fused form    ->  that form (Callee::fused)
//
// A difference of two products, x y - z w, stays as it is where its sign may be seen, as an output, a factor of one, or in what is
// compared or divided by: with one product rounded and the other not, it would have a sign where both are equal, as of
// parallel vectors.  Where it is but a part of longer sums, only x x - y y stays.
// A product that several sums use is fused into all of them or none.  A fused node rounds once where two
// operations rounded twice, and everywhere to the same bits; an intermediate product that would overflow does not.
#pragma once

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

// Never more operations than before.  What the first outputs and the guards are made of stays as it is.
Function fused(const Function& function, std::size_t pinned_outputs);

}  // namespace dyntape::codegen
