// SPDX-License-Identifier: BSD-3-Clause
//
// Functions of <cmath> that a tape does not have: a call is a compile-time error that says what to write instead.
//
//   AD y = tgamma(x);     error: static assertion failed: tgamma of a recorded value: call a Kernel ...
//
// Included by scalar.h.
#pragma once

#include <type_traits>

namespace dyntape {

class AD;

#define DYNTAPE_NOT_RECORDED(function, instead)                                           \
  template <class... Arguments>                                                           \
  requires(std::is_same_v<Arguments, AD> || ...) AD function(const Arguments&...) {       \
    static_assert(sizeof...(Arguments) == 0, #function " of a recorded value: " instead); \
    return {};                                                                            \
  }
#define DYNTAPE_NEEDS_A_KERNEL(function) \
  DYNTAPE_NOT_RECORDED(function,         \
                       "call a Kernel that computes it, with its derivatives (autodiff/graph/callee.h)")
#define DYNTAPE_IS_NO_AD(function, instead) \
  DYNTAPE_NOT_RECORDED(function, "its result is no AD; write " instead)
#define DYNTAPE_ASKS_A_VALUE(function) \
  DYNTAPE_IS_NO_AD(function, #function "(x.value()) to ask the value at the recording point")

// Integers.
DYNTAPE_IS_NO_AD(lround, "round(x), a whole number on the tape")
DYNTAPE_IS_NO_AD(llround, "round(x), a whole number on the tape")
DYNTAPE_IS_NO_AD(lrint, "rint(x), a whole number on the tape")
DYNTAPE_IS_NO_AD(llrint, "rint(x), a whole number on the tape")
DYNTAPE_IS_NO_AD(ilogb, "floor(log2(abs(x)))")

// Digits and exponents.
DYNTAPE_NOT_RECORDED(logb, "write floor(log2(abs(x)))")
DYNTAPE_NOT_RECORDED(frexp, "write e = floor(log2(abs(x))) + 1 and x * exp2(-e)")
DYNTAPE_NOT_RECORDED(ldexp, "write x * exp2(n)")
DYNTAPE_NOT_RECORDED(scalbn, "write x * exp2(n)")
DYNTAPE_NOT_RECORDED(scalbln, "write x * exp2(n)")
DYNTAPE_NOT_RECORDED(modf, "write whole = trunc(x) and x - whole")
DYNTAPE_NOT_RECORDED(remquo, "write r = remainder(x, y) and rint((x - r) / y)")
DYNTAPE_NOT_RECORDED(nextafter, "write x * (1 + epsilon), or take the neighbour of x.value()")
DYNTAPE_NOT_RECORDED(nexttoward, "write x * (1 + epsilon), or take the neighbour of x.value()")
DYNTAPE_NOT_RECORDED(lerp, "write a + t * (b - a)")

// Predicates.
DYNTAPE_IS_NO_AD(signbit, "x < 0.0, or copysign(1.0, x) < 0.0 where the sign of a zero counts")
DYNTAPE_IS_NO_AD(isgreater, "x > y")
DYNTAPE_IS_NO_AD(isgreaterequal, "x >= y")
DYNTAPE_IS_NO_AD(isless, "x < y")
DYNTAPE_IS_NO_AD(islessequal, "x <= y")
DYNTAPE_IS_NO_AD(islessgreater, "x < y || x > y")
DYNTAPE_IS_NO_AD(isunordered, "x != x || y != y")
DYNTAPE_ASKS_A_VALUE(isnormal)
DYNTAPE_ASKS_A_VALUE(fpclassify)

// Special functions.
DYNTAPE_NEEDS_A_KERNEL(tgamma)
DYNTAPE_NEEDS_A_KERNEL(lgamma)
DYNTAPE_NEEDS_A_KERNEL(beta)
DYNTAPE_NEEDS_A_KERNEL(expint)
DYNTAPE_NEEDS_A_KERNEL(riemann_zeta)
DYNTAPE_NEEDS_A_KERNEL(legendre)
DYNTAPE_NEEDS_A_KERNEL(assoc_legendre)
DYNTAPE_NEEDS_A_KERNEL(sph_legendre)
DYNTAPE_NEEDS_A_KERNEL(laguerre)
DYNTAPE_NEEDS_A_KERNEL(assoc_laguerre)
DYNTAPE_NEEDS_A_KERNEL(hermite)
DYNTAPE_NEEDS_A_KERNEL(cyl_bessel_i)
DYNTAPE_NEEDS_A_KERNEL(cyl_bessel_j)
DYNTAPE_NEEDS_A_KERNEL(cyl_bessel_k)
DYNTAPE_NEEDS_A_KERNEL(cyl_neumann)
DYNTAPE_NEEDS_A_KERNEL(sph_bessel)
DYNTAPE_NEEDS_A_KERNEL(sph_neumann)
DYNTAPE_NEEDS_A_KERNEL(ellint_1)
DYNTAPE_NEEDS_A_KERNEL(ellint_2)
DYNTAPE_NEEDS_A_KERNEL(ellint_3)
DYNTAPE_NEEDS_A_KERNEL(comp_ellint_1)
DYNTAPE_NEEDS_A_KERNEL(comp_ellint_2)
DYNTAPE_NEEDS_A_KERNEL(comp_ellint_3)

#undef DYNTAPE_ASKS_A_VALUE
#undef DYNTAPE_IS_NO_AD
#undef DYNTAPE_NEEDS_A_KERNEL
#undef DYNTAPE_NOT_RECORDED

}  // namespace dyntape
