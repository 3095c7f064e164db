// SPDX-License-Identifier: BSD-3-Clause
//
// Operators: names, values, derivative rules.  Everything comes from ops.def, through macros here, in scalar.h,
// jet.h, expr.h (overloads by name), record.cpp (the implementations for scalar.h) and interpret_lanes.cpp (its
// switch).  All other code calls the functions below.
//
//   evaluate(Op::Mul, 2.0, 3.0, 0.0)            -> 6
//   slope(Op::Sin, 0, x, y, z, r, v)            -> v * cos(x), for any T
//   has_slope(Op::Floor, 0)                     -> false
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <string_view>
#include <type_traits>

#include <dyntape/autodiff/own_sines.h>

namespace dyntape {

enum class Op : std::uint8_t {
#define OP(name, ...) name,
#include <dyntape/autodiff/graph/ops.def>
  // Structural kinds, which are not in the table.
  Const,  // a: index into Graph::constants()
  Input,  // a: block, b: index within the block
  Call,  // a: index into Graph::callees(), b: first of its arguments in Graph::call_arguments(), c: number of
         // the call
  Result,  // a: the Call node, b: which of its results
};

inline constexpr int kTableOps = static_cast<int>(Op::Const);

struct OperationCount {
  Op op;
  std::size_t count;
};

// Returns true for rows of the table, whose arguments are nodes.
constexpr bool is_table_op(Op op) { return op < Op::Const; }

// Laws: exact for finite arguments up to the sign of zero.  Graph::make applies them; tests check them.
enum Law : std::uint32_t {
  kNone = 0,
  kCommutative = 1u << 0,  // f(x, y) = f(y, x), for any third argument
  kZeroLeft = 1u << 1,     // f(0, y) = y
  kZeroRight = 1u << 2,    // f(x, 0) = x
  kOneLeft = 1u << 3,      // f(1, y) = y
  kOneRight = 1u << 4,     // f(x, 1) = x
  kAbsorbLeft = 1u << 5,   // f(0, y) = 0
  kAbsorbRight = 1u << 6,  // f(x, 0) = 0
  kOdd = 1u << 7,          // f(-x) = -f(x)
  kEven = 1u << 8,         // f(-x) = f(x)
  kIdempotent = 1u << 9,   // f(f(x)) = f(x)
  kInvolution = 1u << 10,  // f(f(x)) = x
  // Not a law but a property: for some finite arguments the value or a slope of some order is not finite.  Used by
  // the derivation (sweep.h).
  kPole = 1u << 11,
};

struct OpInfo {
  std::string_view name;      // "Mul"
  std::string_view function;  // "operator*"
  int arity;
  std::string_view c;  // C99 with $0 $1 $2
  std::uint32_t laws;
  double lo, hi;  // interval from which tests draw arguments
};

inline constexpr OpInfo kOpInfo[] = {
#define OP(name, fn, n, value, dx, dy, dz, c, laws, lo, hi) {#name, #fn, n, c, laws, lo, hi},
#include <dyntape/autodiff/graph/ops.def>
    {"Const", "", 0, "", kNone, 0, 0},
    {"Input", "", 0, "", kNone, 0, 0},
    {"Call", "", 0, "", kNone, 0, 0},
    {"Result", "", 0, "", kNone, 0, 0},
};

constexpr const OpInfo& info(Op op) { return kOpInfo[static_cast<int>(op)]; }

namespace ops {

// Functions of <cmath>, and those that dyntape has in their place.
#define OP(...)
#define FN(name, fn, ...) using std::fn;
#define OWN(ulp, name, fn, ...) using own::fn;
#include <dyntape/autodiff/graph/ops.def>

// dyntape's functions for number types; graph expressions have their own overloads.
template <class C, class T>
T select(const C& condition, const T& a, const T& b) {
  return condition != C(0) ? a : b;
}
template <class T>
T azmul(const T& x, const T& y) {
  return x == T(0) ? T(0) : x * y;
}
template <class C, class T>
T where(const C& condition, const T& v) {
  return select(condition, v, T(0));
}
template <class C, class T>
T unless(const C& condition, const T& v) {
  return select(condition, T(0), v);
}
template <class T>
T at_pole(const T& v, const T& s) {
  return azmul(v, s);
}
template <class T>
T gate(const T& x, const T& y) {
  return x != T(0) ? y : T(0);
}
template <class T>
T fms(const T& x, const T& y, const T& z) {
  return fma(x, y, -z);
}
template <class T>
T fnma(const T& x, const T& y, const T& z) {
  return fma(-x, y, z);
}
template <class T>
T fnms(const T& x, const T& y, const T& z) {
  return fma(-x, y, -z);
}
template <class T>
T sign(const T& x) {
  return T(int(x > T(0)) - int(x < T(0)));
}

template <class T>
T value_of(Op op, const T& x, const T& y, const T& z) {
  (void)y, (void)z;
  switch (op) {
#define OP(name, fn, n, value, dx, dy, dz, c, laws, lo, hi) \
  case Op::name:                                            \
    return value;
#include <dyntape/autodiff/graph/ops.def>
    default:
      return x;
  }
}

// A row known at compile time.
template <Op op>
struct Row;
#define OP(name, fn, n, value, ...)                   \
  template <>                                         \
  struct Row<Op::name> {                              \
    template <class T>                                \
    static T of(const T& x, const T& y, const T& z) { \
      (void)x, (void)y, (void)z;                      \
      return value;                                   \
    }                                                 \
  };
#include <dyntape/autodiff/graph/ops.def>

template <class T>
T zero_slope() {
  return T(0);
}
template <class T, class S>
T as_slope(const S& s) {
  // A cell with the literal 0 has type int: no slope.
  if constexpr (std::is_same_v<S, int>) {
    return zero_slope<T>();
  } else {
    return s;
  }
}

template <class T>
T slope_of(Op op, int argument, const T& x, const T& y, const T& z, const T& r, const T& v) {
  (void)x, (void)y, (void)z, (void)r;
  switch (op) {
#define OP(name, fn, n, value, dx, dy, dz, c, laws, lo, hi) \
  case Op::name:                                            \
    return argument == 0 ? as_slope<T>(dx) : argument == 1 ? as_slope<T>(dy) : as_slope<T>(dz);
#include <dyntape/autodiff/graph/ops.def>
    default:
      return zero_slope<T>();
  }
}

}  // namespace ops

// The value of a table operator; unused arguments are ignored.
template <class T>
T evaluate(Op op, const T& x, const T& y, const T& z) {
  return ops::value_of<T>(op, x, y, z);
}

template <Op op, class T>
T evaluate(const T& x, const T& y, const T& z) {
  return ops::Row<op>::of(x, y, z);
}

// v after propagation through the given argument of op; forward and reverse mode are the same map.
template <class T>
T slope(Op op, int argument, const T& x, const T& y, const T& z, const T& r, const T& v) {
  return ops::slope_of<T>(op, argument, x, y, z, r, v);
}

namespace ops {

// Facts about a slope's cell: whether there is a slope, whether it multiplies by a number other than 1 and -1, and
// what this number depends on: bits 0 to 2 for x, y, z, bit 3 for r.
struct SlopeCell {
  bool exists, scales;
  unsigned mentions;
};
constexpr bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
constexpr bool mentions(std::string_view cell, char name) {
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const bool begins = i == 0 || !is_letter(cell[i - 1]),
               ends = i + 1 == cell.size() || !is_letter(cell[i + 1]);
    if (cell[i] == name && begins && ends) return true;
  }
  return false;
}
// A cell that is the literal 0 says "no slope".
constexpr SlopeCell read_slope(std::string_view cell) {
  return {cell != "0", cell.find_first_of("*/") != cell.npos,
          mentions(cell, 'x') * 1u + mentions(cell, 'y') * 2u + mentions(cell, 'z') * 4u +
              mentions(cell, 'r') * 8u};
}
inline constexpr SlopeCell kDerivatives[][3] = {
#define OP(name, fn, n, value, dx, dy, dz, ...) {read_slope(#dx), read_slope(#dy), read_slope(#dz)},
#include <dyntape/autodiff/graph/ops.def>
};
inline constexpr SlopeCell kNoSlope = {};
constexpr const SlopeCell& slope_cell(Op op, int argument) {
  const auto row = static_cast<std::size_t>(op);
  return row < std::size(kDerivatives) ? kDerivatives[row][argument] : kNoSlope;
}

}  // namespace ops

// Returns true if the slope of a table operator with respect to that argument is not structurally zero.
constexpr bool has_slope(Op op, int argument) { return ops::slope_cell(op, argument).exists; }

}  // namespace dyntape
