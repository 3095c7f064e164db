// SPDX-License-Identifier: BSD-3-Clause
//
// The recording scalar: computes like a double and records each operation as a node of the tape.  Write the
// functions to record as templates over the scalar, or directly on AD.
//
//   AD f(AD x) { return sin(x) * 2.0 + select(x < 0.0, -x, x); }
//
// Inside record() (record.h), an AD that depends on an input is a node of the tape.  Every other AD is a constant.
//
// Functions of <cmath> are found by argument-dependent lookup: those of ops.def, and fabs, fdim, fmin, fmax,
// nearbyint and hypot of three arguments.  Other functions are a compile-time error that says what to write
// (not_recorded.h).  eigen.h adds Eigen.
//
// A comparison returns a Condition:
//   select(condition, a, b)   records both branches; the recording is valid everywhere.  Prefer it in your own code
//   if (condition)            takes the branch of the recording point and records a guard (Eigen's factorisations do).
//                             An evaluation that leaves this branch reports file and line of the comparison
//
// RecordingError: an AD of an earlier recording is used in a new one.  A value that is computed *before* record() is
// a constant, not a variable.
// a value computed *before* record() is a constant, not a variable.
#pragma once

#include <iosfwd>
#include <type_traits>

#include <dyntape/autodiff/graph/composed.h>
#include <dyntape/autodiff/graph/graph.h>

namespace dyntape {

class AD {
 public:
  AD() = default;
  AD(double value) : value_(value) {}  // NOLINT: the one implicit constructor; int and float come through it

  // The value at the recording point.
  double value() const { return value_; }
  // Whether the value depends on an input of the current recording; otherwise it is a constant.
  bool is_recorded() const { return id_ != kNoNode; }
  // The node; with the highest bit set, the negation of that node.
  NodeId id() const { return id_; }
  std::uint32_t tape() const { return tape_; }

  AD& operator+=(const AD& other);
  AD& operator-=(const AD& other);
  AD& operator*=(const AD& other);
  AD& operator/=(const AD& other);

  // For the recording machinery.
  AD(double value, NodeId id, std::uint32_t tape) : value_(value), id_(id), tape_(tape) {}

 private:
  double value_ = 0;
  NodeId id_ = kNoNode;
  std::uint32_t tape_ = 0;  // serial number of the recording that made the node
};

namespace detail {
// One function for each operator (record.cpp).  Arguments are passed by value: two registers each.
template <Op op>
AD apply(AD a);
template <Op op>
AD apply(AD a, AD b);
template <Op op>
AD apply(AD a, AD b, AD c);
}  // namespace detail

// Comparisons use operators that know their place in the source (below), not the functions of this table.
#define OP(name, fn, n, ...) DYNTAPE_AD_##n(name, fn)
#define DYNTAPE_AD_1(name, fn) \
  inline AD fn(const AD& a) { return detail::apply<Op::name>(a); }
#define DYNTAPE_AD_2(name, fn) \
  inline AD fn(const AD& a, const AD& b) { return detail::apply<Op::name>(a, b); }
#define DYNTAPE_AD_3(name, fn) \
  inline AD fn(const AD& a, const AD& b, const AD& c) { return detail::apply<Op::name>(a, b, c); }
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_AD_1
#undef DYNTAPE_AD_2
#undef DYNTAPE_AD_3

inline AD operator+(const AD& a) { return a; }
inline AD& AD::operator+=(const AD& other) { return *this = *this + other; }
inline AD& AD::operator-=(const AD& other) { return *this = *this - other; }
inline AD& AD::operator*=(const AD& other) { return *this = *this * other; }
inline AD& AD::operator/=(const AD& other) { return *this = *this / other; }

inline AD fabs(const AD& a) { return abs(a); }
inline AD nearbyint(const AD& a) { return rint(a); }

// The result of a comparison, with its place in the source.
class Condition {
 public:
  Condition(const AD& truth, const char* file, int line) : truth_(truth), file_(file), line_(line) {}

  // Takes the branch of the recording point and records the guard.
  operator bool() const;  // NOLINT: `if (x < y)` in templated code must compile

  const AD& truth() const { return truth_; }  // 0 or 1
  const char* file() const { return file_; }
  int line() const { return line_; }

 private:
  AD truth_;
  const char* file_;
  int line_;
};

// An operand of a comparison, with the place of the comparison: the default arguments are evaluated there.
struct Located {
  AD value;
  const char* file;
  int line;
  Located(const AD& v, const char* f = __builtin_FILE(), int l = __builtin_LINE())
      : value(v), file(f), line(l) {}
  template <class Number>
  requires std::is_arithmetic_v<Number> Located(Number v, const char* f = __builtin_FILE(),
                                                int l = __builtin_LINE())
      : value(static_cast<double>(v)), file(f), line(l) {}
};

inline Condition operator<(const Located& a, const Located& b) {
  return {less(a.value, b.value), a.file, a.line};
}
inline Condition operator>(const Located& a, const Located& b) {
  return {less(b.value, a.value), a.file, a.line};
}
inline Condition operator<=(const Located& a, const Located& b) {
  return {less_equal(a.value, b.value), a.file, a.line};
}
inline Condition operator>=(const Located& a, const Located& b) {
  return {less_equal(b.value, a.value), a.file, a.line};
}
inline Condition operator==(const Located& a, const Located& b) {
  return {equal(a.value, b.value), a.file, a.line};
}
inline Condition operator!=(const Located& a, const Located& b) {
  return {not_equal(a.value, b.value), a.file, a.line};
}

// Both branches are recorded; the derivative of the one not taken contributes exactly zero.
inline AD select(const Condition& condition, const AD& a, const AD& b) {
  return select(condition.truth(), a, b);
}
inline AD select(bool condition, const AD& a, const AD& b) { return condition ? a : b; }

// Record both sides of a conjunction of Conditions.  With a plain bool, the built-in && and || apply: they skip the
// right side if they can, and the Condition becomes a bool with a guard:
//
//   if (limit && x[0] > limit->upper)                    a guard if there is a limit
//   flag ? select(x[0] > 0, a, b) : b                    select(flag && x[0] > 0, a, b) without a guard
inline Condition operator!(const Condition& c) {
  return {select(c.truth(), AD(0), AD(1)), c.file(), c.line()};
}
inline Condition operator&&(const Condition& a, const Condition& b) {
  return {select(a.truth(), b.truth(), AD(0)), a.file(), a.line()};
}
inline Condition operator||(const Condition& a, const Condition& b) {
  return {select(a.truth(), AD(1), b.truth()), a.file(), a.line()};
}

// As in C: the other argument where one is a NaN.
inline AD fmin(const AD& a, const AD& b) { return select(a == a, select(b == b, min(a, b), a), b); }
inline AD fmax(const AD& a, const AD& b) { return select(a == a, select(b == b, max(a, b), a), b); }

inline AD fdim(const AD& a, const AD& b) { return ops::positive_difference(a, b); }
inline AD hypot(const AD& a, const AD& b, const AD& c) { return ops::length_of_three(a, b, c); }

// Predicates of the value at the recording point; they do not branch on the tape (Eigen asks them).
inline bool isnan(const AD& a) { return std::isnan(a.value()); }
inline bool isinf(const AD& a) { return std::isinf(a.value()); }
inline bool isfinite(const AD& a) { return std::isfinite(a.value()); }

std::ostream& operator<<(std::ostream& out, const AD& a);

}  // namespace dyntape

#include <dyntape/autodiff/record/not_recorded.h>
