// SPDX-License-Identifier: BSD-3-Clause
//
// CppAD's conditional expressions and the other free functions of CppAD that code for OCS2 calls, for recorded
// numbers and doubles.
//
//   namespace CppAD = dyntape::ocs2::cppad_names;         // for code that spells CppAD::
//   y = CppAD::CondExpLt(x, zero, -x, x);                  // |x|; records both sides, valid at every point
//   y = CondExpLt(x, zero, -x, x);                         // recorded numbers need no prefix
//
// All five relations exist.  Operands are recorded numbers, doubles, or both.  The side that is not taken
// contributes exactly zero to every derivative, also if that side is not finite.
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

#include <dyntape/autodiff/record/scalar.h>

namespace dyntape {
namespace detail {

template <class... T>
using CondExpResult = std::conditional_t<(std::is_same_v<std::remove_cvref_t<T>, AD> || ...), AD, double>;
template <class T>
concept CondExpOperand =
    std::is_same_v<std::remove_cvref_t<T>, AD> || std::is_arithmetic_v<std::remove_cvref_t<T>>;

template <class Result, class T>
Result taken(const auto& condition, const T& if_true, const T& if_false) {
  if constexpr (std::is_same_v<Result, AD>) {
    return select(condition, AD(if_true), AD(if_false));
  } else {
    return condition ? if_true : if_false;
  }
}

}  // namespace detail

// if_true if `left RELATION right` is true, else if_false.
#define DYNTAPE_COND_EXP(Relation, op)                                                                      \
  template <detail::CondExpOperand L, detail::CondExpOperand R, detail::CondExpOperand A,                   \
            detail::CondExpOperand B>                                                                       \
  detail::CondExpResult<L, R, A, B> CondExp##Relation(const L& left, const R& right, const A& if_true,      \
                                                      const B& if_false) {                                  \
    using Result = detail::CondExpResult<L, R, A, B>;                                                       \
    return detail::taken<Result, Result>(Result(left) op Result(right), Result(if_true), Result(if_false)); \
  }
DYNTAPE_COND_EXP(Lt, <)
DYNTAPE_COND_EXP(Le, <=)
DYNTAPE_COND_EXP(Eq, ==)
DYNTAPE_COND_EXP(Ge, >=)
DYNTAPE_COND_EXP(Gt, >)
#undef DYNTAPE_COND_EXP

namespace ocs2::cppad_names {

using dyntape::CondExpEq;
using dyntape::CondExpGe;
using dyntape::CondExpGt;
using dyntape::CondExpLe;
using dyntape::CondExpLt;

// CppAD::sqrt(x) and similar: dyntape's functions for recorded numbers, those of <cmath> for doubles.
#define DYNTAPE_OF_BOTH(f) \
  using dyntape::f;        \
  using std::f;
DYNTAPE_OF_BOTH(abs)
DYNTAPE_OF_BOTH(acos)
DYNTAPE_OF_BOTH(acosh)
DYNTAPE_OF_BOTH(asin)
DYNTAPE_OF_BOTH(asinh)
DYNTAPE_OF_BOTH(atan)
DYNTAPE_OF_BOTH(atan2)
DYNTAPE_OF_BOTH(atanh)
DYNTAPE_OF_BOTH(cos)
DYNTAPE_OF_BOTH(cosh)
DYNTAPE_OF_BOTH(erf)
DYNTAPE_OF_BOTH(exp)
DYNTAPE_OF_BOTH(expm1)
DYNTAPE_OF_BOTH(fabs)
DYNTAPE_OF_BOTH(log)
DYNTAPE_OF_BOTH(log10)
DYNTAPE_OF_BOTH(log1p)
DYNTAPE_OF_BOTH(pow)
DYNTAPE_OF_BOTH(sin)
DYNTAPE_OF_BOTH(sinh)
DYNTAPE_OF_BOTH(sqrt)
DYNTAPE_OF_BOTH(tan)
DYNTAPE_OF_BOTH(tanh)
#undef DYNTAPE_OF_BOTH

template <class T>
T sign(const T& x) {
  return CondExpGt(x, T(0), T(1), CondExpLt(x, T(0), T(-1), T(0)));
}
template <class T>
bool isnan(const T& x) {
  if constexpr (std::is_same_v<T, AD>) {
    return std::isnan(x.value());
  } else {
    return std::isnan(x);
  }
}
// The number at the recording point, as a double and as a constant of the recording.
inline double Value(const AD& x) { return x.value(); }
inline AD Var2Par(const AD& x) { return AD(x.value()); }
inline bool Variable(const AD& x) { return x.is_recorded(); }
inline bool Parameter(const AD& x) { return !x.is_recorded(); }
template <class T>
struct numeric_limits {
  static T epsilon() { return T(std::numeric_limits<double>::epsilon()); }
  static T min() { return T(std::numeric_limits<double>::min()); }
  static T max() { return T(std::numeric_limits<double>::max()); }
  static T quiet_NaN() { return T(std::numeric_limits<double>::quiet_NaN()); }
};

}  // namespace ocs2::cppad_names

namespace ocs2 {
using dyntape::CondExpEq;
using dyntape::CondExpGe;
using dyntape::CondExpGt;
using dyntape::CondExpLe;
using dyntape::CondExpLt;
}  // namespace ocs2

}  // namespace dyntape
