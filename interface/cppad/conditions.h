// SPDX-License-Identifier: BSD-3-Clause
//
// Conditional expressions, and predicates of values that templates call for any base.
//
//   AD<double> y = CondExpGt(x, AD<double>(0), sqrt(x), AD<double>(0));   // computes both; a comparison with NaN is false
//
// The branch that is not taken contributes exactly zero to derivatives of any order.
#pragma once

#include <dyntape/interface/cppad/ad.h>

namespace CppAD::inline dyntape_names {

enum CompareOp { CompareLt, CompareLe, CompareEq, CompareGe, CompareGt, CompareNe };

namespace detail {

template <Row row, class Base>
AD<Base> selected(const AD<Base>& left, const AD<Base>& right, const AD<Base>& if_true,
                  const AD<Base>& if_false) {
  check_order<row, Base>("CondExp");
  return apply<Row::Select>(apply<row>(left, right), if_true, if_false);
}

template <Row row, class Number>
requires kIsNumber<Number> Number selected(const Number& left, const Number& right, const Number& if_true,
                                           const Number& if_false) {
  if constexpr (row == Row::Eq) {
    return left == right ? if_true : if_false;
  } else if constexpr (kIsOrdered<Number>) {
    return (row == Row::Lt ? left < right : left <= right) ? if_true : if_false;
  } else {
    refuse_order_of_complex("CondExp");
  }
}

}  // namespace detail

template <class Scalar>
concept Conditional = std::floating_point<Scalar> || detail::kIsComplex<Scalar> || requires(Scalar x) {
  x.tape();
};

template <Conditional S>
S CondExpLt(const S& left, const S& right, const S& if_true, const S& if_false) {
  return detail::selected<detail::Row::Lt>(left, right, if_true, if_false);
}
template <Conditional S>
S CondExpLe(const S& left, const S& right, const S& if_true, const S& if_false) {
  return detail::selected<detail::Row::Le>(left, right, if_true, if_false);
}
template <Conditional S>
S CondExpEq(const S& left, const S& right, const S& if_true, const S& if_false) {
  return detail::selected<detail::Row::Eq>(left, right, if_true, if_false);
}
template <Conditional S>
S CondExpGe(const S& left, const S& right, const S& if_true, const S& if_false) {
  return detail::selected<detail::Row::Le>(right, left, if_true, if_false);
}
template <Conditional S>
S CondExpGt(const S& left, const S& right, const S& if_true, const S& if_false) {
  return detail::selected<detail::Row::Lt>(right, left, if_true, if_false);
}
template <Conditional S>
S CondExpOp(CompareOp op, const S& left, const S& right, const S& if_true, const S& if_false) {
  switch (op) {
    case CompareLt:
      return CondExpLt(left, right, if_true, if_false);
    case CompareLe:
      return CondExpLe(left, right, if_true, if_false);
    case CompareEq:
      return CondExpEq(left, right, if_true, if_false);
    case CompareGe:
      return CondExpGe(left, right, if_true, if_false);
    case CompareGt:
      return CondExpGt(left, right, if_true, if_false);
    default:
      return CondExpEq(left, right, if_false, if_true);
  }
}
// An old name of CondExpGt(flag, 0, ...).
template <Conditional S>
S CondExp(const S& flag, const S& if_true, const S& if_false) {
  return CondExpGt(flag, S(0), if_true, if_false);
}

// The number below all levels of recording.
template <class Number>
requires detail::kIsNumber<Number> Number plain_value(const Number& x) { return x; }
template <class Base>
requires detail::kIsPlain<Base>
auto plain_value(const AD<Base>& x) { return plain_value(x.value()); }

// --- predicates of the value: each is asked of a number, or of the base ---
template <class Number>
requires detail::kIsNumber<Number>
bool IdenticalCon(const Number&) { return true; }
template <class Base>
bool IdenticalCon(const AD<Base>& x) {
  return Constant(x) && IdenticalCon(detail::given(x.value()));
}
#define DYNTAPE_CPPAD_CONSTANT(name, number)                 \
  template <class Number>                                    \
  requires detail::kIsNumber<Number>                         \
  bool name(const Number& x) { return x == Number(number); } \
  template <class Base>                                      \
  bool name(const AD<Base>& x) {                             \
    return Constant(x) && name(detail::given(x.value()));    \
  }
DYNTAPE_CPPAD_CONSTANT(IdenticalZero, 0)
DYNTAPE_CPPAD_CONSTANT(IdenticalOne, 1)
#undef DYNTAPE_CPPAD_CONSTANT
// Whether x and y are the same constant; EqualOpSeq: or the same node.
template <class Number>
requires detail::kIsNumber<Number>
bool IdenticalEqualCon(const Number& x, const Number& y) { return x == y; }
template <class Base>
bool IdenticalEqualCon(const AD<Base>& x, const AD<Base>& y) {
  return Constant(x) && Constant(y) && IdenticalEqualCon(detail::given(x.value()), detail::given(y.value()));
}
template <class Number>
requires detail::kIsNumber<Number>
bool EqualOpSeq(const Number& x, const Number& y) { return x == y; }
template <class Base>
bool EqualOpSeq(const AD<Base>& x, const AD<Base>& y) {
  if (Constant(x) || Constant(y))
    return Constant(x) && Constant(y) && EqualOpSeq(detail::given(x.value()), detail::given(y.value()));
  return x.id() == y.id();
}

#define DYNTAPE_CPPAD_ORDER(name, relation)     \
  template <class Number>                       \
  requires detail::kIsNumber<Number>            \
  bool name(const Number& x) {                  \
    if constexpr (detail::kIsOrdered<Number>) { \
      return x relation 0;                      \
    } else {                                    \
      detail::refuse_order_of_complex(#name);   \
    }                                           \
  }                                             \
  template <class Base>                         \
  bool name(const AD<Base>& x) {                \
    return name(detail::given(x.value()));      \
  }
DYNTAPE_CPPAD_ORDER(GreaterThanZero, >)
DYNTAPE_CPPAD_ORDER(GreaterThanOrZero, >=)
DYNTAPE_CPPAD_ORDER(LessThanZero, <)
DYNTAPE_CPPAD_ORDER(LessThanOrZero, <=)
#undef DYNTAPE_CPPAD_ORDER
template <class Number>
requires detail::kIsNumber<Number>
bool abs_geq(const Number& x, const Number& y) { return std::abs(x) >= std::abs(y); }
template <class Base>
bool abs_geq(const AD<Base>& x, const AD<Base>& y) {
  return abs_geq(detail::given(x.value()), detail::given(y.value()));
}

template <class Number>
requires(!requires(Number x) { x.tape(); }) bool isnan(const Number& x) { return x != x; }
template <class Base>
bool isnan(const AD<Base>& x) {
  return isnan(x.value());
}
template <class Base>
bool isinf(const AD<Base>& x) {
  return std::isinf(plain_value(x));
}
template <class Base>
bool isfinite(const AD<Base>& x) {
  return std::isfinite(plain_value(x));
}
template <class Vector>
bool hasnan(const Vector& v) {
  for (std::size_t i = 0; i < std::size_t(v.size()); ++i) {
    if (isnan(v[i])) return true;
  }
  return false;
}

namespace detail {
// The limits of a type as values of S.
template <class S, class Limits>
struct LimitsAs {
  static S epsilon() { return S(Limits::epsilon()); }
  static S min() { return S((Limits::min)()); }
  static S max() { return S((Limits::max)()); }
  static S quiet_NaN() { return S(Limits::quiet_NaN()); }
  static S infinity() { return S(Limits::infinity()); }
  static constexpr int digits = Limits::digits;
  static constexpr int digits10 = Limits::digits10;
  static constexpr int max_digits10 = Limits::max_digits10;
};
}  // namespace detail
// Programs specialise it for their bases.
template <class S>
struct numeric_limits : detail::LimitsAs<S, std::numeric_limits<S>> {};
template <class Float>
struct numeric_limits<std::complex<Float>> : detail::LimitsAs<std::complex<Float>, numeric_limits<Float>> {};
template <class Base>
struct numeric_limits<AD<Base>> : detail::LimitsAs<AD<Base>, numeric_limits<Base>> {};
template <class S>
S nan(const S&) {
  return numeric_limits<S>::quiet_NaN();
}
template <class S>
S epsilon() {
  return numeric_limits<S>::epsilon();
}

}  // namespace CppAD::inline dyntape_names

// Digits and similar constants are those of the base; values have the type of the scalar.
template <class Base>
struct std::numeric_limits<CppAD::AD<Base>> : std::numeric_limits<Base> {
  using S = CppAD::AD<Base>;
  static S epsilon() { return std::numeric_limits<Base>::epsilon(); }
  static S min() { return (std::numeric_limits<Base>::min)(); }
  static S max() { return (std::numeric_limits<Base>::max)(); }
  static S lowest() { return std::numeric_limits<Base>::lowest(); }
  static S round_error() { return std::numeric_limits<Base>::round_error(); }
  static S infinity() { return std::numeric_limits<Base>::infinity(); }
  static S quiet_NaN() { return std::numeric_limits<Base>::quiet_NaN(); }
  static S signaling_NaN() { return std::numeric_limits<Base>::signaling_NaN(); }
  static S denorm_min() { return std::numeric_limits<Base>::denorm_min(); }
};

// Declares `bool name(AD<Base>)` and `bool name(AD<Base>, AD<Base>)` for functions of Base: of the values, without a
// guard.
#define CPPAD_BOOL_UNARY(Base, name) \
  inline bool name(const ::CppAD::AD<Base>& x) { return name(x.value()); }
#define CPPAD_BOOL_BINARY(Base, name)                                        \
  inline bool name(const ::CppAD::AD<Base>& x, const ::CppAD::AD<Base>& y) { \
    return name(x.value(), y.value());                                       \
  }
