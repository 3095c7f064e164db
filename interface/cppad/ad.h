// SPDX-License-Identifier: BSD-3-Clause
//
// The recording scalar with CppAD's names: a value, and a node of the graph of the open recording.
//
//   AD<double> x = 2.0, y = sin(x) * 3 + CondExpLt(x, AD<double>(0), -x, x);
//
// AD<AD<double>> records on two levels.  A value of a recording that has ended, or of no recording, is a constant.
// Bases other than those of kIsCompiled need bases.h.  The functions of <cmath> in autodiff/graph/ops.def exist, and
// azmul, sign, min and max.
//
// A comparison returns the bool of the recording point.  During a recording, each comparison leaves a guard with its
// place.  ADFun::compare_change_number() counts the comparisons with another result; functions made by to_library()
// throw GuardViolation.
#pragma once

#include <cmath>
#include <complex>
#include <concepts>
#include <cstdint>
#include <iostream>
#include <limits>
#include <type_traits>

#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

template <class Base>
class AD;

// The argument of a function of a base.  A program defines these functions in namespace CppAD or in its base's, and
// may do so behind this header: a call with this type finds both.
template <class Base>
struct BaseArgument {
  const Base& value;
  operator const Base&() const { return value; }  // NOLINT
};

namespace detail {

template <class Number>
inline constexpr bool kIsComplex = false;
template <class Float>
inline constexpr bool kIsComplex<std::complex<Float>> = true;
// Bases that the library has; bases.h defines the templates for all others.
template <class Base>
inline constexpr bool kIsCompiled = std::is_floating_point_v<Base>;
template <>
inline constexpr bool kIsCompiled<std::complex<float>> = true;
template <>
inline constexpr bool kIsCompiled<std::complex<double>> = true;
template <>
inline constexpr bool kIsCompiled<AD<double>> = true;
template <>
inline constexpr bool kIsCompiled<AD<AD<double>>> = true;
template <class Base>
struct Defined {};
template <class Base>
concept IsBase = kIsCompiled<Base> || requires(Defined<Base> base) {
  define_any_base(base);  // bases.h
};

// Whether a number, below all levels of recording, is a float of some width.
template <class Number>
inline constexpr bool kIsReal = std::is_arithmetic_v<Number>;
template <class Base>
inline constexpr bool kIsReal<AD<Base>> = kIsReal<Base>;
// Whether it is a number of C++.
template <class Number>
inline constexpr bool kIsNumber = std::is_arithmetic_v<Number> || kIsComplex<Number>;
template <class Number>
inline constexpr bool kIsPlain = kIsNumber<Number>;
template <class Base>
inline constexpr bool kIsPlain<AD<Base>> = kIsPlain<Base>;
template <class Number>
inline constexpr bool kIsRecorded = false;
template <class Base>
inline constexpr bool kIsRecorded<AD<Base>> = true;

template <class Base>
decltype(auto) given(const Base& x) {
  if constexpr (kIsNumber<Base> || kIsRecorded<Base>) {
    return (x);
  } else {
    return BaseArgument<Base>{x};
  }
}

// The rows of the table of operators, numbered as in Op.  This header does not include op.h.
enum class Row : std::uint8_t {
#define OP(name, ...) name,
#include <dyntape/autodiff/graph/ops.def>
};

enum class Kind : std::uint8_t { kConstant, kDynamic, kVariable };

// Defined in bases/recorded.hxx, for every base.
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

// ArgumentError: the function needs an order of numbers, and the base is complex.
template <class Number>
inline constexpr bool kIsOrdered = !kIsComplex<Number>;
template <class Base>
inline constexpr bool kIsOrdered<AD<Base>> = kIsOrdered<Base>;
[[noreturn]] void refuse_order_of_complex(const char* function);
template <Row row, class Base>
void check_order(const char* function) {
  if constexpr (!kIsOrdered<Base> && (row == Row::Abs || row == Row::Sign || row == Row::Min ||
                                      row == Row::Max || row == Row::Lt || row == Row::Le))
    refuse_order_of_complex(function);
}

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
  static_assert(
      detail::IsBase<Base>,
      "AD<Base>: include <cppad/base_require.hpp> (dyntape/interface/cppad/bases.h) for a base that is not "
      "float, double, long double, std::complex, AD<double> or AD<AD<double>>");

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
#define DYNTAPE_CPPAD_1(name, fn)                      \
  using std::fn;                                       \
  template <class Base>                                \
  AD<Base> fn(const AD<Base>& x) {                     \
    detail::check_order<detail::Row::name, Base>(#fn); \
    return detail::apply<detail::Row::name>(x);        \
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
  detail::check_order<detail::Row::Sign, Base>("sign");
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
template <class Number>
requires detail::kIsNumber<Number> Number azmul(const Number& x, const Number& y) {
  return x == Number(0) ? Number(0) : x * y;
}
// Record no guard, unlike std::min and std::max.
template <class Base>
AD<Base> min(const AD<Base>& x, const AD<Base>& y) {
  detail::check_order<detail::Row::Min, Base>("min");
  return detail::apply<detail::Row::Min>(x, y);
}
template <class Base>
AD<Base> max(const AD<Base>& x, const AD<Base>& y) {
  detail::check_order<detail::Row::Max, Base>("max");
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
template <class Float>
int Integer(const std::complex<Float>& x) {
  return static_cast<int>(x.real());
}
template <class Base>
int Integer(const AD<Base>& x) {
  return Integer(detail::given(x.value()));
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
  return out << detail::given(x.value());
}
template <class Base>
std::istream& operator>>(std::istream& in, AD<Base>& x) {
  Base value;
  in >> value;
  x = AD<Base>(value);
  return in;
}

}  // namespace CppAD::inline dyntape_names
