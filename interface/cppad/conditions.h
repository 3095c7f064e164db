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
  return apply<Row::Select>(apply<row>(left, right), if_true, if_false);
}

template <Row row, std::floating_point Float>
Float selected(Float left, Float right, Float if_true, Float if_false) {
  const bool truth = row == Row::Lt ? left < right : row == Row::Le ? left <= right : left == right;
  return truth ? if_true : if_false;
}

}  // namespace detail

template <class Scalar>
concept Conditional = std::floating_point<Scalar> || requires(Scalar x) {
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

// --- predicates of the value, for any number of levels ---
template <std::floating_point Float>
Float plain_value(Float x) {
  return x;
}
template <class Base>
auto plain_value(const AD<Base>& x) {
  return plain_value(x.value());
}
template <std::floating_point Float>
bool IdenticalCon(Float) {
  return true;
}
template <class Base>
bool IdenticalCon(const AD<Base>& x) {
  return Constant(x) && IdenticalCon(x.value());
}
template <Conditional S>
bool IdenticalZero(const S& x) {
  return IdenticalCon(x) && plain_value(x) == 0;
}
template <Conditional S>
bool IdenticalOne(const S& x) {
  return IdenticalCon(x) && plain_value(x) == 1;
}
template <Conditional S>
bool IdenticalEqualCon(const S& x, const S& y) {
  return IdenticalCon(x) && IdenticalCon(y) && plain_value(x) == plain_value(y);
}
// Whether x and y are the same constant or the same node.
template <std::floating_point Float>
bool EqualOpSeq(Float x, Float y) {
  return x == y;
}
template <class Base>
bool EqualOpSeq(const AD<Base>& x, const AD<Base>& y) {
  if (Constant(x) || Constant(y)) return Constant(x) && Constant(y) && EqualOpSeq(x.value(), y.value());
  return x.id() == y.id();
}

template <Conditional S>
bool GreaterThanZero(const S& x) {
  return plain_value(x) > 0;
}
template <Conditional S>
bool GreaterThanOrZero(const S& x) {
  return plain_value(x) >= 0;
}
template <Conditional S>
bool LessThanZero(const S& x) {
  return plain_value(x) < 0;
}
template <Conditional S>
bool LessThanOrZero(const S& x) {
  return plain_value(x) <= 0;
}
template <Conditional S>
bool abs_geq(const S& x, const S& y) {
  return std::abs(plain_value(x)) >= std::abs(plain_value(y));
}

template <Conditional S>
bool isnan(const S& x) {
  return std::isnan(plain_value(x));
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
template <Conditional S>
S nan(const S&) {
  return S(std::numeric_limits<double>::quiet_NaN());
}

template <class S>
struct numeric_limits {
  using Float = decltype(plain_value(S()));
  static S epsilon() { return S(std::numeric_limits<Float>::epsilon()); }
  static S min() { return S((std::numeric_limits<Float>::min)()); }
  static S max() { return S((std::numeric_limits<Float>::max)()); }
  static S quiet_NaN() { return S(std::numeric_limits<Float>::quiet_NaN()); }
  static S infinity() { return S(std::numeric_limits<Float>::infinity()); }
  static constexpr int digits10 = std::numeric_limits<Float>::digits10;
  static constexpr int max_digits10 = std::numeric_limits<Float>::max_digits10;
};
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
