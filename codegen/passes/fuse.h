// SPDX-License-Identifier: BSD-3-Clause
//
// Fuses products and sums into one instruction, in the graph; the compiler never contracts.
//
//   x * y + z, x * y - z, z - x * y      ->  fma(x, y, z) and similar, if only sums use the product
//   (a * b + c * d) + (e * f + g * h)    ->  ((a * b + c * d) + e * f) + g * h, with one unfused product
//   a kernel with a fused form           ->  that form (Callee::fused)
//
// A difference of two products, x y - z w, is not fused if its sign may matter: as an output, as a factor of an
// output, in a comparison or in a divisor.  If only one product were rounded, the difference of equal products, as
// of parallel vectors, would have a sign.  As a part of longer sums, only x x - y y is not fused.  A product that
// several sums use is fused into all of them or none.  A fused node rounds once instead of twice, to the same bits
// everywhere; an intermediate product that would overflow does not overflow.
#pragma once

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

// Never adds operations.  Does not change the nodes that the first outputs and the guards depend on.
Function fused(const Function& function, std::size_t pinned_outputs);

}  // namespace dyntape::codegen
