// SPDX-License-Identifier: BSD-3-Clause
//
// The implementations of elementary functions (sine, exponential, ...) with which a recorded function is evaluated.
//
//   kSines      dyntape's own sine and cosine (own_sines.h), within 0.81 ulp; the other functions of the C library.
//               Has the bits of the algorithms of dynamics/ in plain double; fastest for one state
//   kLibm       all functions of the C library: the bits of plain C++ on this machine
//   kPortable   sine and cosine as in kSines, the others of SLEEF: within 1 ulp (erfc: 1.5) of normal results.
//               The same bits on every processor and in 1, 2, 4, 8 lanes; in lanes much faster than the C library.
//               For one state SLEEF's functions take 2 to 7 times as long.  They overflow early: asinh, acosh from
//               1.3e154 on, log1p near 1e307, sinh and cosh from 709.7 on, pow near 1.8e308
#pragma once

#include <cmath>
#include <string_view>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

enum class Functions { kSines, kLibm, kPortable };

// The default of every route.
inline constexpr Functions kDefaultFunctions = Functions::kSines;

// The functions of the operator table whose implementations differ: the name, and the accuracy in SLEEF's name of
// the function.  Other functions (sqrt, floor, fmod, ...) are exact, or correctly rounded, everywhere.
struct PortableFunction {
  std::string_view name, accuracy;
};
inline constexpr PortableFunction kPortableFunctions[] = {
#define OP(...)
#define FN(...)
#define LIBM(ulp, name, fn, ...) {#fn, #ulp},
#include <dyntape/autodiff/graph/ops.def>
};

// Returns true if libm's function for an operator differs from SLEEF's or dyntape's own.
constexpr bool has_portable_form(Op op) {
  for (const PortableFunction& f : kPortableFunctions) {
    if (info(op).function == f.name) return true;
  }
  return false;
}

// Returns true for sine and cosine, which dyntape implements itself.
constexpr bool is_turn(Op op) {
#define OP(...)
#define OWN(ulp, name, ...) \
  if (op == Op::name) return true;
#include <dyntape/autodiff/graph/ops.def>
  return false;
}

// Returns true if an operator is computed by its portable form.
constexpr bool is_portable(Op op, Functions functions) {
  return functions == Functions::kPortable ? has_portable_form(op)
                                           : functions == Functions::kSines && is_turn(op);
}

// Evaluates an operator by libm; evaluate() uses dyntape's own sines.
template <Op op>
double evaluate_by_libm(double x, double y, double z) {
  if constexpr (op == Op::Sin) return std::sin(x);
  if constexpr (op == Op::Cos) return std::cos(x);
  return evaluate<op, double>(x, y, z);
}

// Computes n values (1, 2, 4 or 8) of an operator with a portable form; reads `y` if it takes two arguments.
void portable_values(Op op, const double* x, const double* y, double* result, int n);

}  // namespace dyntape
