// SPDX-License-Identifier: BSD-3-Clause
//
// Which elementary functions a recorded function is evaluated with.
//
//   kLibm       the C library's: what plain C++ gives on this machine
//   kPortable   SLEEF's deterministic ones: within 1 ulp (erfc: 1.5), with the same bits on every processor and
//               in 1, 2, 4 and 8 lanes, and in vectors much faster than the C library
//
//   portable_values(Op::Sin, x, nullptr, y, 8);      eight sines
#pragma once

#include <string_view>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

enum class Functions { kLibm, kPortable };

// The functions of the operator table that differ between the two: name, and the accuracy that SLEEF names them
// by.  The others (sqrt, floor, fmod, ...) are exact, or correctly rounded, everywhere.
// clang-format off
#define DYNTAPE_PORTABLE_UNARY(X)                                                                             \
  X(sin, u10) X(cos, u10) X(tan, u10) X(asin, u10) X(acos, u10) X(atan, u10) X(sinh, u10) X(cosh, u10)        \
  X(tanh, u10) X(asinh, u10) X(acosh, u10) X(atanh, u10) X(exp, u10) X(expm1, u10) X(log, u10) X(log1p, u10)  \
  X(log10, u10) X(cbrt, u10) X(erf, u10) X(erfc, u15)
#define DYNTAPE_PORTABLE_BINARY(X) X(atan2, u10) X(pow, u10) X(hypot, u05)
// clang-format on

struct PortableFunction {
  std::string_view name, accuracy;
};
inline constexpr PortableFunction kPortableFunctions[] = {
#define DYNTAPE_ROW(fn, ulp) {#fn, #ulp},
    DYNTAPE_PORTABLE_UNARY(DYNTAPE_ROW) DYNTAPE_PORTABLE_BINARY(DYNTAPE_ROW)
#undef DYNTAPE_ROW
};

// Whether the two differ in an operator.
constexpr bool has_portable_form(Op op) {
  for (const PortableFunction& f : kPortableFunctions) {
    if (info(op).function == f.name) return true;
  }
  return false;
}

// Of an operator that has one: n values (1, 2, 4 or 8); `y` is read if it takes two arguments.
void portable_values(Op op, const double* x, const double* y, double* result, int n);

}  // namespace dyntape
