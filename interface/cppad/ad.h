// SPDX-License-Identifier: BSD-3-Clause
//
// The recording scalar with CppAD's names: a value, and a node of the graph of the open recording.
//
//   AD<double> x = 2.0, y = sin(x) * 3 + CondExpLt(x, AD<double>(0), -x, x);
//
// AD<AD<double>> records on two levels: its values are recorded, too.  A value of a recording that has ended, or of
// no recording, is a constant.  All functions of <cmath> in autodiff/graph/ops.def exist, and azmul, sign, min and
// max.
//
// A comparison returns the bool of the recording point.  During a recording, each comparison leaves a guard with its
// place.  ADFun::compare_change_number() counts the comparisons with another result; functions made by to_library()
// throw GuardViolation.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <iostream>
#include <limits>
#include <type_traits>

#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

template <class Base>
class AD;

namespace detail {

template <class Base>
inline constexpr bool kIsBase = false;
template <>
inline constexpr bool kIsBase<float> = true;
template <>
inline constexpr bool kIsBase<double> = true;
template <>
inline constexpr bool kIsBase<AD<double>> = true;
template <>
inline constexpr bool kIsBase<AD<AD<double>>> = true;

// The rows of the table of operators, numbered as in Op.  This header does not include op.h.
enum class Row : std::uint8_t {
#define OP(name, ...) name,
#include <dyntape/autodiff/graph/ops.def>
};

enum class Kind : std::uint8_t { kConstant, kDynamic, kVariable };

// Defined in recorded.cpp, for every base.
template <Row row, class Base>
AD<Base> apply(AD<Base> x);
template <Row row, class Base>
AD<Base> apply(AD<Base> x, AD<Base> y);
template <Row row, class Base>
AD<Base> apply(AD<Base> x, AD<Base> y, AD<Base> z);
// The same for a row known at run time only; ignores arguments that the row does not take.
template <class Base>
AD<Base> apply(Row row, const AD<Base>& x, const AD<Base>& y, const AD<Base>& z);
template <class Base>
bool compare(Row row, const AD<Base>& x, const AD<Base>& y, const char* file, int line);
template <class Base>
Kind kind_of(const AD<Base>& x);
template <class Base>
const Base& value_to_keep(const AD<Base>& x);

// An operand of a comparison, with the place of the comparison: the default arguments are evaluated there.
template <class Scalar>
struct Located {
  Scalar value;
  const char* file;
  int line;
  template <class Number>
  requires std::convertible_to<const Number&, Scalar> Located(const Number& v,  // NOLINT
                                                              const char* f = __builtin_FILE(),
                                                              int l = __builtin_LINE())
      : value(v), file(f), line(l) {}
};

}  // namespace detail

template <class Base>
class AD {
  static_assert(detail::kIsBase<Base>, "AD<Base>: Base is float, double, AD<double> or AD<AD<double>>");

 public:
  using value_type = Base;

  AD() = default;
  AD(const Base& value) : value_(value) {}  // NOLINT: numbers mix with recorded values
  template <class Number>
  requires(std::is_arithmetic_v<Number> && !std::is_same_v<Number, Base>) AD(Number value)  // NOLINT
      : value_(static_cast<Base>(value)) {}

  AD& operator+=(const AD& b) { return *this = *this + b; }
  AD& operator-=(const AD& b) { return *this = *this - b; }
  AD& operator*=(const AD& b) { return *this = *this * b; }
  AD& operator/=(const AD& b) { return *this = *this / b; }

  friend AD operator+(const AD& a) { return a; }
  friend AD operator-(const AD& a) { return detail::apply<detail::Row::Neg>(a); }
  friend AD operator+(const AD& a, const AD& b) { return detail::apply<detail::Row::Add>(a, b); }
  friend AD operator-(const AD& a, const AD& b) { return detail::apply<detail::Row::Sub>(a, b); }
  friend AD operator*(const AD& a, const AD& b) { return detail::apply<detail::Row::Mul>(a, b); }
  friend AD operator/(const AD& a, const AD& b) { return detail::apply<detail::Row::Div>(a, b); }

  using Operand = detail::Located<AD>;
  friend bool operator<(const Operand& a, const Operand& b) {
    return detail::compare(detail::Row::Lt, a.value, b.value, a.file, a.line);
  }
  friend bool operator<=(const Operand& a, const Operand& b) {
    return detail::compare(detail::Row::Le, a.value, b.value, a.file, a.line);
  }
  friend bool operator>(const Operand& a, const Operand& b) {
    return detail::compare(detail::Row::Lt, b.value, a.value, a.file, a.line);
  }
  friend bool operator>=(const Operand& a, const Operand& b) {
    return detail::compare(detail::Row::Le, b.value, a.value, a.file, a.line);
  }
  friend bool operator==(const Operand& a, const Operand& b) {
    return detail::compare(detail::Row::Eq, a.value, b.value, a.file, a.line);
  }
  friend bool operator!=(const Operand& a, const Operand& b) {
    return detail::compare(detail::Row::Ne, a.value, b.value, a.file, a.line);
  }

  // Ends the recording of this thread, if there is one, without a function.
  static void abort_recording();

  // --- CppADCodeGen's names, where CG<Base> is this type (cg.h) ---
  bool isParameter() const { return detail::kind_of(*this) != detail::Kind::kVariable; }
  bool isVariable() const { return !isParameter(); }
  bool isValueDefined() const { return true; }
  const Base& getValue() const { return value_; }
  void setValue(const Base& value) { value_ = value; }
  bool isIdenticalZero() const {
    return detail::kind_of(*this) == detail::Kind::kConstant && value_ == Base(0);
  }
  bool isIdenticalOne() const {
    return detail::kind_of(*this) == detail::Kind::kConstant && value_ == Base(1);
  }

  // --- for the recording machinery (autodiff/record/tape.h) ---
  AD(const Base& value, std::uint32_t id, std::uint32_t tape) : value_(value), id_(id), tape_(tape) {}
  const Base& value() const { return value_; }
  std::uint32_t id() const { return id_; }
  std::uint32_t tape() const { return tape_; }     // 0: of no recording
  bool is_recorded() const { return tape_ != 0; }  // of some recording, which may be over

 private:
  Base value_{};
  std::uint32_t id_ = 0;
  std::uint32_t tape_ = 0;
};

template <class Number, class Base>
concept MixesWith = !std::is_base_of_v<AD<Base>, Number> && std::convertible_to<const Number&, AD<Base>>;

// Functions of <cmath>, of AD and of what mixes with it.
#define OP(...)
#define FN(name, fn, n, ...) DYNTAPE_CPPAD_##n(name, fn)
#define DYNTAPE_CPPAD_1(name, fn)               \
  using std::fn;                                \
  template <class Base>                         \
  AD<Base> fn(const AD<Base>& x) {              \
    return detail::apply<detail::Row::name>(x); \
  }
#define DYNTAPE_CPPAD_2(name, fn)                            \
  using std::fn;                                             \
  template <class Base>                                      \
  AD<Base> fn(const AD<Base>& x, const AD<Base>& y) {        \
    return detail::apply<detail::Row::name>(x, y);           \
  }                                                          \
  template <class Base, MixesWith<Base> Number>              \
  AD<Base> fn(const AD<Base>& x, const Number& y) {          \
    return detail::apply<detail::Row::name>(x, AD<Base>(y)); \
  }                                                          \
  template <class Base, MixesWith<Base> Number>              \
  AD<Base> fn(const Number& x, const AD<Base>& y) {          \
    return detail::apply<detail::Row::name>(AD<Base>(x), y); \
  }
#define DYNTAPE_CPPAD_3(name, fn)                                        \
  using std::fn;                                                         \
  template <class Base>                                                  \
  AD<Base> fn(const AD<Base>& x, const AD<Base>& y, const AD<Base>& z) { \
    return detail::apply<detail::Row::name>(x, y, z);                    \
  }
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_CPPAD_1
#undef DYNTAPE_CPPAD_2
#undef DYNTAPE_CPPAD_3

using std::fabs;
template <class Base>
AD<Base> fabs(const AD<Base>& x) {
  return abs(x);
}
template <class Base>
AD<Base> nearbyint(const AD<Base>& x) {
  return rint(x);
}
template <class Base>
AD<Base> sign(const AD<Base>& x) {
  return detail::apply<detail::Row::Sign>(x);
}
template <std::floating_point Float>
Float sign(Float x) {
  return Float(int(x > 0) - int(x < 0));
}
// x y; 0 if x is 0, for every y.
template <class Base>
AD<Base> azmul(const AD<Base>& x, const AD<Base>& y) {
  return detail::apply<detail::Row::Azmul>(x, y);
}
template <class Base, MixesWith<Base> Number>
AD<Base> azmul(const AD<Base>& x, const Number& y) {
  return azmul(x, AD<Base>(y));
}
template <class Base, MixesWith<Base> Number>
AD<Base> azmul(const Number& x, const AD<Base>& y) {
  return azmul(AD<Base>(x), y);
}
template <std::floating_point Float>
Float azmul(Float x, Float y) {
  return x == 0 ? Float(0) : x * y;
}
// Record no guard, unlike std::min and std::max.
template <class Base>
AD<Base> min(const AD<Base>& x, const AD<Base>& y) {
  return detail::apply<detail::Row::Min>(x, y);
}
template <class Base>
AD<Base> max(const AD<Base>& x, const AD<Base>& y) {
  return detail::apply<detail::Row::Max>(x, y);
}
template <class Base>
AD<Base> fmin(const AD<Base>& x, const AD<Base>& y) {
  return min(x, y);
}
template <class Base>
AD<Base> fmax(const AD<Base>& x, const AD<Base>& y) {
  return max(x, y);
}

// --- what a value is ---

// The value of x.  RecordingError: x is a variable of an open recording; use Var2Par.
template <class Base>
Base Value(const AD<Base>& x) {
  return detail::value_to_keep(x);
}
// The value of x as a constant.
template <class Base>
AD<Base> Var2Par(const AD<Base>& x) {
  return AD<Base>(x.value());
}
template <std::floating_point Float>
int Integer(Float x) {
  return static_cast<int>(x);
}
template <class Base>
int Integer(const AD<Base>& x) {
  return Integer(x.value());
}
template <class Base>
bool Constant(const AD<Base>& x) {
  return detail::kind_of(x) == detail::Kind::kConstant;
}
template <class Base>
bool Dynamic(const AD<Base>& x) {
  return detail::kind_of(x) == detail::Kind::kDynamic;
}
template <class Base>
bool Parameter(const AD<Base>& x) {
  return detail::kind_of(x) != detail::Kind::kVariable;
}
template <class Base>
bool Variable(const AD<Base>& x) {
  return detail::kind_of(x) == detail::Kind::kVariable;
}

template <class Base>
std::ostream& operator<<(std::ostream& out, const AD<Base>& x) {
  return out << x.value();
}
template <class Base>
std::istream& operator>>(std::istream& in, AD<Base>& x) {
  Base value;
  in >> value;
  x = AD<Base>(value);
  return in;
}

}  // namespace CppAD::inline dyntape_names
