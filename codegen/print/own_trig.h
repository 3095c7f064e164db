// SPDX-License-Identifier: BSD-3-Clause
//
// sin and cos as C text, for targets whose libm is slow, inexact or absent: additions, multiplications and
// 32-bit integers only, hence the same bits on every processor with IEEE arithmetic.
//
// Within 0.78 ulp of the true value in double, 0.82 in float, however large the argument is (measured: millions
// of doubles against 113 bits, nearly all floats; tests/codegen/own_trig_test.cpp).  NaN of infinities; the sign
// of zero is kept.
//
// Reduction: up to 1e6 by three parts of pi / 2 with exact products (doubles only); beyond, and for floats
// always, by an integer product with those bits of 2 / pi that decide.  The polynomials are minimax on
// [-pi/4, pi/4], of degree 13 and 14 for doubles, 7 and 8 for floats, their coefficients rounded one after the
// other.
#pragma once

#include <string>

namespace dyntape::codegen {

// Text that defines dt_sin and dt_cos, those that are asked for, of `real`; it needs <stdint.h>.
std::string own_trig(bool single, bool sine, bool cosine);

}  // namespace dyntape::codegen
