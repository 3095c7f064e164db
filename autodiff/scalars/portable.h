// SPDX-License-Identifier: BSD-3-Clause
//
// Which elementary functions a recorded function is evaluated with.
//
//   kLibm       the C library's: what plain C++ gives on this machine
//   kPortable   within 1 ulp (erfc: 1.5) of normal results, sine and cosine (sines.h) within 0.8; the others are SLEEF's.  The
//               same bits on every processor and in 1, 2, 4, 8 lanes, and in lanes much faster than the C library's.  Infinite
//               too soon: asinh, acosh from 1.3e154 on, log1p near 1e307, sinh, cosh from 709.7 on, pow near 1.8e308
#pragma once

#include <string_view>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

enum class Functions { kLibm, kPortable };

// The functions of the operator table that differ between the two: name, and the accuracy that SLEEF names them
// by.  The others (sqrt, floor, fmod, ...) are exact, or correctly rounded, everywhere.
struct PortableFunction {
  std::string_view name, accuracy;
};
inline constexpr PortableFunction kPortableFunctions[] = {
#define OP(...)
#define FN(...)
#define LIBM(ulp, name, fn, ...) {#fn, #ulp},
#include <dyntape/autodiff/graph/ops.def>
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
