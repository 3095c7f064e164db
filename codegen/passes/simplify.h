// SPDX-License-Identifier: BSD-3-Clause
//
// What a profile may do to a graph beyond what recording does already.
//
//   Function cheaper = simplify(function, Profile::kFast);              before derivation
//   Derivatives d = simplify(derive(cheaper, order), Profile::kFast);   after it
//
// strict: nothing.  fast: rewrites that are exact over the reals and change rounding,
//
//   x / d, y / d          ->  r = 1 / d, x * r, y * r           a reciprocal that several divisions share
//   x / c                 ->  x * (1 / c)                       c a constant whose reciprocal is normal
//   a * x + a * y         ->  a * (x + y)                       likewise a difference, and a common divisor
//   x * y + z             ->  fma(x, y, z)                      codegen/passes/fuse.h; where the target has_fma
//
// each where it takes no more operations.  A result differs from strict by a few units in the last place of
// the largest intermediate value.  It is lost where what is made anew leaves the range of doubles: the reciprocal of a
// divisor below 6e-309, the sum x + y of terms near 1e308.  NaN and infinity are not assumed away, and every evaluation of one graph has the same
// bits, by whatever route.
//
// A pattern may lose an entry that is zero everywhere.  In weighted Hessians of functions with poles, gates of the weights
// (autodiff/derive/flow.h) stand between terms that could be factored otherwise: fast may take a few operations more than strict.
//
// What square roots, logarithms and other operators with an end to their range are made of stays as it is: where
// strict gives sqrt(0), fast does not give the root of a rounding error.  Conditions of guards stay too, and in a
// derived function the values too: y has the same bits in all kernels.
#pragma once

#include <dyntape/codegen/options/options.h>

namespace dyntape::codegen {

Function simplify(const Function& function, Profile profile, bool has_fma = false);
Derivatives simplify(Derivatives derivatives, Profile profile, bool has_fma = false);

}  // namespace dyntape::codegen
