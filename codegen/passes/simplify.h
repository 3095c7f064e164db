// SPDX-License-Identifier: BSD-3-Clause
//
// Rewrites a graph as its profile allows, beyond the simplifications of recording.
//
//   Function cheaper = simplify(function, Profile::kFast);              before derivation
//   Derivatives d = simplify(derive(cheaper, order), Profile::kFast);   after it
//
// strict: none.  fast: rewrites that are exact over the reals and change rounding, if they add no operation,
//
//   x / d, y / d          ->  r = 1 / d, x * r, y * r           a reciprocal that several divisions share
//   x / c                 ->  x * (1 / c)                       c a constant whose reciprocal is normal
//   a * x + a * y         ->  a * (x + y)                       likewise a difference, and a common divisor
//   x * y + z             ->  fma(x, y, z)                      codegen/passes/fuse.h; where the target has_fma
//
// A result differs from strict by a few units in the last place of the largest intermediate value.  The result is
// lost if a new value leaves the range of doubles: the reciprocal of a divisor below 6e-309, the sum x + y of terms
// near 1e308.  NaN and infinity are respected.  All routes evaluate one graph to the same bits.
//
// A pattern may lose an entry that is zero everywhere.  In weighted Hessians of functions with poles, gates of the
// weights (autodiff/derive/flow.h) separate terms that could otherwise be factored: fast may take a few operations
// more than strict.
//
// Unchanged are: the arguments of square roots, logarithms and other operators with an end of their range, so that
// fast does not compute the root of a rounding error where strict computes sqrt(0); the conditions of guards; and in
// a derived function the values: y has the same bits in all kernels.
#pragma once

#include <dyntape/codegen/options/options.h>

namespace dyntape::codegen {

Function simplify(const Function& function, Profile profile, bool has_fma = false);
Derivatives simplify(Derivatives derivatives, Profile profile, bool has_fma = false);

}  // namespace dyntape::codegen
