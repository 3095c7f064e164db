// SPDX-License-Identifier: BSD-3-Clause
//
// Dual numbers: a value with its tangents in N directions, by the rules of ops.def.
//
//   using Dual = Jet<double, 1>;
//   Dual x = Dual::variable(0.5, 0);                 // dx/dx = 1
//   Dual y = sin(x) * sin(x) + cos(x);
//   y.value(), y.tangent(0);                         // f and f'
//
// Use jets for forward derivatives without a tape: a template runs on jets as on numbers, and one run gives N
// columns of a Jacobian.  Values have the bits of a run on T.  A tangent does not depend on N or on the other
// directions.
//
// T is a float, also of 113 bits, or another jet: Jet<Jet<double, 1>, 1> has second derivatives.
//
// Comparisons compare values and return bools: the code takes the branch of the value.  Constants have zero
// tangents.  At kinks and ends of functions, the conventions of ops.def apply.
#pragma once

#include <array>
#include <concepts>
#include <type_traits>

#include <dyntape/autodiff/graph/composed.h>
#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

namespace ops {

// slope() for a row and an argument known at compile time: the compiler removes the switch, which every tangent
// would otherwise pass.
template <Op op, int argument>
struct Passage;
#define DYNTAPE_JET_PASSAGE(name, argument, cell)                             \
  template <>                                                                 \
  struct Passage<Op::name, argument> {                                        \
    template <class T>                                                        \
    static T of(const T& x, const T& y, const T& z, const T& r, const T& v) { \
      (void)x, (void)y, (void)z, (void)r, (void)v;                            \
      return as_slope<T>(cell);                                               \
    }                                                                         \
  };
#define OP(name, fn, n, value, dx, dy, dz, ...) \
  DYNTAPE_JET_PASSAGE(name, 0, dx) DYNTAPE_JET_PASSAGE(name, 1, dy) DYNTAPE_JET_PASSAGE(name, 2, dz)
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_JET_PASSAGE

}  // namespace ops

template <class T, int N>
class Jet {
 public:
  Jet() : Jet(T(0)) {}
  // A constant.
  template <class Number>
  requires std::convertible_to<Number, T> Jet(const Number& value)  // NOLINT: constants mix with jets
      : value_(value) {
    tangents_.fill(T(0));
  }
  // The independent variable of the given direction.
  static Jet variable(const T& value, int direction) {
    Jet x(value);
    x.tangents_[direction] = T(1);
    return x;
  }

  const T& value() const { return value_; }
  const T& tangent(int direction) const { return tangents_[direction]; }
  T& tangent(int direction) { return tangents_[direction]; }

  Jet& operator+=(const Jet& b) { return *this = *this + b; }
  Jet& operator-=(const Jet& b) { return *this = *this - b; }
  Jet& operator*=(const Jet& b) { return *this = *this * b; }
  Jet& operator/=(const Jet& b) { return *this = *this / b; }
  friend Jet operator+(const Jet& a) { return a; }

// All functions of the table.
#define OP(name, fn, n, ...) DYNTAPE_JET_##n(name, fn)
#define DYNTAPE_JET_1(name, fn) \
  friend Jet fn(const Jet& a) { return apply<Op::name>(a); }
#define DYNTAPE_JET_2(name, fn) \
  friend Jet fn(const Jet& a, const Jet& b) { return apply<Op::name>(a, b); }
#define DYNTAPE_JET_3(name, fn) \
  friend Jet fn(const Jet& a, const Jet& b, const Jet& c) { return apply<Op::name>(a, b, c); }
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_JET_1
#undef DYNTAPE_JET_2
#undef DYNTAPE_JET_3

  friend Jet select(bool condition, const Jet& a, const Jet& b) { return condition ? a : b; }
  friend Jet fabs(const Jet& a) { return abs(a); }
  friend Jet nearbyint(const Jet& a) { return rint(a); }
  friend Jet fdim(const Jet& a, const Jet& b) { return ops::positive_difference(a, b); }
  friend Jet hypot(const Jet& a, const Jet& b, const Jet& c) { return ops::length_of_three(a, b, c); }

  friend bool operator<(const Jet& a, const Jet& b) { return a.value_ < b.value_; }
  friend bool operator<=(const Jet& a, const Jet& b) { return a.value_ <= b.value_; }
  friend bool operator>(const Jet& a, const Jet& b) { return a.value_ > b.value_; }
  friend bool operator>=(const Jet& a, const Jet& b) { return a.value_ >= b.value_; }
  friend bool operator==(const Jet& a, const Jet& b) { return a.value_ == b.value_; }
  friend bool operator!=(const Jet& a, const Jet& b) { return a.value_ != b.value_; }

 private:
  // The sum, over the arguments with a slope, of slope times tangent.
  template <Op op, class... Arguments>
  static Jet apply(const Arguments&... arguments) {
    const Jet* a[3] = {&arguments...};
    const T zero(0);
    const T &x = a[0]->value_, &y = a[1] ? a[1]->value_ : zero, &z = a[2] ? a[2]->value_ : zero;
    Jet r(evaluate<op>(x, y, z));
    bool first = true;
    const auto add = [&]<int argument>(std::integral_constant<int, argument>) {
      if constexpr (argument < int(sizeof...(Arguments)) && has_slope(op, argument)) {
        for (int k = 0; k < N; ++k) {
          const T through = ops::Passage<op, argument>::of(x, y, z, r.value_, a[argument]->tangents_[k]);
          r.tangents_[k] = first ? through : r.tangents_[k] + through;
        }
        first = false;
      }
    };
    add(std::integral_constant<int, 0>()), add(std::integral_constant<int, 1>()),
        add(std::integral_constant<int, 2>());
    return r;
  }

  T value_;
  std::array<T, N> tangents_;
};

}  // namespace dyntape
