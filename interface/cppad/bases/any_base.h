// SPDX-License-Identifier: BSD-3-Clause
//
// The operators of the table over a base that is neither a float nor recorded: by the functions of the base that
// CppAD requires (base_require), which are found by their names when the base is known.  Internal.
#pragma once

#include <dyntape/autodiff/evaluate/series.h>
#include <dyntape/interface/cppad/conditions.h>

namespace CppAD::inline dyntape_names::detail {

template <class Base>
inline constexpr bool kIsOther = !std::is_arithmetic_v<Base> && !kIsRecorded<Base>;

[[noreturn]] void refuse_missing(const char* function);  // ArgumentError

// Programs ask for no order of complex numbers (check_order), but the slope of tanh does: it is that of the real parts,
// as are abs and sign below.
template <class Base>
Base chosen(CompareOp relation, const Base& left, const Base& right, const Base& if_true,
            const Base& if_false) {
  if constexpr (kIsComplex<Base>) {
    const bool truth = relation == CompareEq   ? left == right
                       : relation == CompareLt ? left.real() < right.real()
                                               : left.real() <= right.real();
    return truth ? if_true : if_false;
  } else {
    return CondExpOp(relation, given(left), given(right), given(if_true), given(if_false));
  }
}

// The function of the base with the name of the row.
template <Op op>
struct NamedFunction;
#define DYNTAPE_CPPAD_NAMED(name, fn, n, ...)            \
  template <>                                            \
  struct NamedFunction<Op::name> {                       \
    template <class Base>                                \
    static Base of(const Base& x, const Base& y) {       \
      (void)x, (void)y;                                  \
      if constexpr (requires { DYNTAPE_CPPAD_##n(fn); }) \
        return DYNTAPE_CPPAD_##n(fn);                    \
      else                                               \
        refuse_missing(#fn);                             \
    }                                                    \
  };
#define OP(...)
#define FN DYNTAPE_CPPAD_NAMED
#define DYNTAPE_CPPAD_1(fn) fn(given(x))
#define DYNTAPE_CPPAD_2(fn) fn(given(x), given(y))
#define DYNTAPE_CPPAD_3(fn) fn(given(x), given(y), given(y))
#include <dyntape/autodiff/graph/ops.def>
DYNTAPE_CPPAD_NAMED(Sign, sign, 1)
#undef DYNTAPE_CPPAD_NAMED
#undef DYNTAPE_CPPAD_1
#undef DYNTAPE_CPPAD_2
#undef DYNTAPE_CPPAD_3

template <Op op, class Base>
Base evaluate_base(const Base& x, const Base& y, const Base& z) {
  (void)x, (void)y, (void)z;
  if constexpr (op == Op::Add)
    return x + y;
  else if constexpr (op == Op::Sub)
    return x - y;
  else if constexpr (op == Op::Mul)
    return x * y;
  else if constexpr (op == Op::Div)
    return x / y;
  else if constexpr (op == Op::Neg)
    return -x;
  else if constexpr (op == Op::Fma)
    return x * y + z;
  else if constexpr (op == Op::Fms)
    return x * y - z;
  else if constexpr (op == Op::Fnma)
    return z - x * y;
  else if constexpr (op == Op::Fnms)
    return -(x * y) - z;
  else if constexpr (op == Op::Azmul)
    return azmul(given(x), given(y));
  else if constexpr (op == Op::Gate)
    return chosen(CompareEq, x, Base(0), Base(0), y);
  else if constexpr (op == Op::Select)
    return chosen(CompareEq, x, Base(0), z, y);
  else if constexpr (op == Op::Lt)
    return chosen(CompareLt, x, y, Base(1), Base(0));
  else if constexpr (op == Op::Le)
    return chosen(CompareLe, x, y, Base(1), Base(0));
  else if constexpr (op == Op::Eq)
    return chosen(CompareEq, x, y, Base(1), Base(0));
  else if constexpr (op == Op::Ne)
    return chosen(CompareEq, x, y, Base(0), Base(1));
  else if constexpr (op == Op::Min)
    return chosen(CompareLt, y, x, y, x);
  else if constexpr (op == Op::Max)
    return chosen(CompareLt, x, y, y, x);
  else if constexpr (op == Op::Hypot)
    return sqrt(given(Base(x * x + y * y)));
  else if constexpr (op == Op::Exp2)
    return exp(given(Base(x * Base(0.6931471805599453094))));
  else if constexpr (op == Op::Log2)
    return log(given(x)) / Base(0.6931471805599453094);
  else if constexpr (op == Op::Abs && kIsComplex<Base>)
    return Base(std::abs(x.real()));
  else if constexpr (op == Op::Sign && kIsComplex<Base>)
    return Base(static_cast<typename Base::value_type>((x.real() > 0) - (x.real() < 0)));
  else
    return NamedFunction<op>::of(x, y);
}

template <class Base>
bool is_zero_of_base(const Base& x) {
  return IdenticalZero(given(x));
}

}  // namespace CppAD::inline dyntape_names::detail

namespace dyntape {

// The conditions of such a base may differ from element to element of a value, so none is known as a whole.
template <class Base>
requires CppAD::detail::kIsOther<Base>
struct SeriesNumber<Base> {
  static constexpr bool kKnown = false;
  static Base evaluate(Op op, const Base& x, const Base& y, const Base& z) {
    switch (op) {
#define OP(name, ...) \
  case Op::name:      \
    return CppAD::detail::evaluate_base<Op::name>(x, y, z);
#include <dyntape/autodiff/graph/ops.def>
      default:
        __builtin_unreachable();
    }
  }
  static bool is_zero(const Base& x) { return CppAD::detail::is_zero_of_base(x); }
};

}  // namespace dyntape
