// SPDX-License-Identifier: BSD-3-Clause
//
// Two bases as users write them: one whose functions are in its own namespace, and one of three numbers at once, whose
// functions are in namespace CppAD, as CppAD's page on base_require has them.
#pragma once

#include <dyntape/interface/cppad/bases.h>

#define BASE_ARITHMETIC(Base, of)                               \
  friend Base operator+(const Base& a, const Base& b) {         \
    return of(a, b, [](double x, double y) { return x + y; });  \
  }                                                             \
  friend Base operator-(const Base& a, const Base& b) {         \
    return of(a, b, [](double x, double y) { return x - y; });  \
  }                                                             \
  friend Base operator*(const Base& a, const Base& b) {         \
    return of(a, b, [](double x, double y) { return x * y; });  \
  }                                                             \
  friend Base operator/(const Base& a, const Base& b) {         \
    return of(a, b, [](double x, double y) { return x / y; });  \
  }                                                             \
  friend Base operator-(const Base& a) {                        \
    return of(a, a, [](double x, double) { return -x; });       \
  }                                                             \
  Base& operator+=(const Base& b) { return *this = *this + b; } \
  Base& operator-=(const Base& b) { return *this = *this - b; } \
  Base& operator*=(const Base& b) { return *this = *this * b; } \
  Base& operator/=(const Base& b) { return *this = *this / b; }
// The functions that CppAD requires of a base.
#define BASE_FUNCTIONS(Base, of, FN)                                                                        \
  FN(acos)                                                                                                  \
  FN(acosh)                                                                                                 \
  FN(asin)                                                                                                  \
  FN(asinh) FN(atan) FN(atanh) FN(cos) FN(cosh) FN(erf) FN(erfc) FN(exp) FN(expm1) FN(fabs) FN(abs) FN(log) \
      FN(log1p) FN(log10) FN(sin) FN(sinh) FN(sqrt) FN(tan) FN(tanh) inline Base                            \
      pow(const Base& a, const Base& b) {                                                                   \
    return of(a, b, [](double x, double y) { return std::pow(x, y); });                                     \
  }                                                                                                         \
  inline Base sign(const Base& a) {                                                                         \
    return of(a, a, [](double x, double) { return double((x > 0) - (x < 0)); });                            \
  }

namespace units {

class Number {
 public:
  Number() = default;
  Number(double v) : value(v) {}  // NOLINT
  template <class Function>
  static Number of(const Number& a, const Number& b, Function f) {
    return f(a.value, b.value);
  }
  BASE_ARITHMETIC(Number, of)
  friend bool operator==(const Number& a, const Number& b) { return a.value == b.value; }
  friend bool operator<(const Number& a, const Number& b) { return a.value < b.value; }
  friend bool operator<=(const Number& a, const Number& b) { return a.value <= b.value; }
  friend std::ostream& operator<<(std::ostream& out, const Number& a) { return out << a.value << " units"; }
  double value = 0;
};
#define UNITS_FN(fn) \
  inline Number fn(const Number& a) { return std::fn(a.value); }
BASE_FUNCTIONS(Number, Number::of, UNITS_FN)
#undef UNITS_FN
inline bool IdenticalCon(const Number&) { return true; }
inline bool IdenticalZero(const Number& a) { return a.value == 0; }
inline bool IdenticalOne(const Number& a) { return a.value == 1; }
inline bool IdenticalEqualCon(const Number& a, const Number& b) { return a == b; }
inline bool EqualOpSeq(const Number& a, const Number& b) { return a == b; }
inline bool GreaterThanZero(const Number& a) { return a.value > 0; }
inline bool abs_geq(const Number& a, const Number& b) { return std::abs(a.value) >= std::abs(b.value); }
inline int Integer(const Number& a) { return int(a.value); }
inline Number CondExpOp(CppAD::CompareOp op, const Number& a, const Number& b, const Number& t,
                        const Number& f) {
  const bool truth = op == CppAD::CompareLt   ? a.value < b.value
                     : op == CppAD::CompareLe ? a.value <= b.value
                     : op == CppAD::CompareEq ? a.value == b.value
                     : op == CppAD::CompareGe ? a.value >= b.value
                                              : a.value > b.value;
  return truth ? t : f;
}
CPPAD_COND_EXP_REL(Number)
CPPAD_AZMUL(Number)

}  // namespace units

struct Triple {
  double v[3] = {0, 0, 0};
  Triple() = default;
  Triple(double all) : v{all, all, all} {}  // NOLINT
  Triple(double a, double b, double c) : v{a, b, c} {}
  template <class Function>
  static Triple of(const Triple& a, const Triple& b, Function f) {
    return {f(a.v[0], b.v[0]), f(a.v[1], b.v[1]), f(a.v[2], b.v[2])};
  }
  BASE_ARITHMETIC(Triple, of)
  friend bool operator==(const Triple& a, const Triple& b) {
    return a.v[0] == b.v[0] && a.v[1] == b.v[1] && a.v[2] == b.v[2];
  }
};
namespace CppAD {
#define TRIPLE_FN(fn)                                                             \
  inline Triple fn(const Triple& a) {                                             \
    return Triple::of(a, a, [](double x, double) { return double(std::fn(x)); }); \
  }
BASE_FUNCTIONS(Triple, Triple::of, TRIPLE_FN)
#undef TRIPLE_FN
inline bool IdenticalCon(const Triple&) { return true; }
inline bool IdenticalZero(const Triple& a) { return a == Triple(0); }
inline bool IdenticalOne(const Triple& a) { return a == Triple(1); }
inline bool IdenticalEqualCon(const Triple& a, const Triple& b) { return a == b; }
inline bool EqualOpSeq(const Triple& a, const Triple& b) { return a == b; }
inline bool GreaterThanZero(const Triple& a) { return a.v[0] > 0; }
inline int Integer(const Triple& a) { return int(a.v[0]); }
inline Triple azmul(const Triple& x, const Triple& y) {
  return Triple::of(x, y, [](double a, double b) { return a == 0 ? 0 : a * b; });
}
inline Triple CondExpOp(CompareOp op, const Triple& a, const Triple& b, const Triple& t, const Triple& f) {
  Triple r;
  for (int i = 0; i < 3; ++i) {
    const double x = a.v[i], y = b.v[i];
    const bool truth = op == CompareLt   ? x < y
                       : op == CompareLe ? x <= y
                       : op == CompareEq ? x == y
                       : op == CompareGe ? x >= y
                                         : x > y;
    r.v[i] = truth ? t.v[i] : f.v[i];
  }
  return r;
}
CPPAD_COND_EXP_REL(Triple)
CPPAD_NUMERIC_LIMITS(double, units::Number)
CPPAD_NUMERIC_LIMITS(double, Triple)
CPPAD_TO_STRING(Triple)
inline std::ostream& operator<<(std::ostream& out, const Triple& a) {
  return out << '(' << a.v[0] << ' ' << a.v[1] << ' ' << a.v[2] << ')';
}
}  // namespace CppAD
