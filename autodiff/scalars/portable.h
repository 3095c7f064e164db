// SPDX-License-Identifier: BSD-3-Clause
//
// Which elementary functions a recorded function is evaluated with.
//
//   kSines      sine and cosine of dyntape's own (own_sines.h), within 0.8 ulp, and the C library's others: what the algorithms
//               of dynamics/ have in plain double, and quickest for one state
//   kLibm       all of the C library: what plain C++ gives on this machine
//   kPortable   none of the C library: within 1 ulp (erfc: 1.5) of normal results, sine and cosine as in kSines, the others
//               SLEEF's.  The same bits on every processor and in 1, 2, 4, 8 lanes, and in lanes much faster than the C
//               library's; for one state SLEEF's take 2 to 7 times as long.  Infinite too soon: asinh, acosh from 1.3e154
//               on, log1p near 1e307, sinh, cosh from 709.7 on, pow near 1.8e308
#pragma once

#include <cmath>
#include <string_view>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

enum class Functions { kSines, kLibm, kPortable };

// The default of every route.
inline constexpr Functions kDefaultFunctions = Functions::kSines;

// The functions of the operator table that differ between them: name, and the accuracy that SLEEF names them
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

// Whether libm's and SLEEF's or dyntape's own differ in an operator.
constexpr bool has_portable_form(Op op) {
  for (const PortableFunction& f : kPortableFunctions) {
    if (info(op).function == f.name) return true;
  }
  return false;
}

// Sine and cosine, which dyntape has itself.
constexpr bool is_turn(Op op) {
#define OP(...)
#define OWN(ulp, name, ...) \
  if (op == Op::name) return true;
#include <dyntape/autodiff/graph/ops.def>
  return false;
}

// Whether an operator is computed by its portable form.
constexpr bool is_portable(Op op, Functions functions) {
  return functions == Functions::kPortable ? has_portable_form(op)
                                           : functions == Functions::kSines && is_turn(op);
}

// What libm has for a row of the table; evaluate() has dyntape's own sines.
template <Op op>
double evaluate_by_libm(double x, double y, double z) {
  if constexpr (op == Op::Sin) return std::sin(x);
  if constexpr (op == Op::Cos) return std::cos(x);
  return evaluate<op, double>(x, y, z);
}

// Of an operator that has a portable form: n values (1, 2, 4 or 8); `y` is read if it takes two arguments.
void portable_values(Op op, const double* x, const double* y, double* result, int n);

}  // namespace dyntape
