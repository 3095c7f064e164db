// SPDX-License-Identifier: BSD-3-Clause
//
// Random analytic expressions in any scalar, and derivatives of them by dual numbers, whose rules are written here.
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <vector>

#include "autodiff/quad.h"
#include "autodiff/random.h"

namespace expressions {

using dyntape::testing::Quad;
using dyntape::testing::Random;

// v + d e with e e = 0; of duals: derivatives of higher order.
template <class T>
struct Dual {
  T v{}, d{};
  Dual() = default;
  Dual(double c) : v(c), d(0.0) {}  // NOLINT
  Dual(const T& value, const T& slope) : v(value), d(slope) {}
};
template <class T>
Dual<T> operator+(const Dual<T>& a, const Dual<T>& b) {
  return {a.v + b.v, a.d + b.d};
}
template <class T>
Dual<T> operator-(const Dual<T>& a, const Dual<T>& b) {
  return {a.v - b.v, a.d - b.d};
}
template <class T>
Dual<T> operator*(const Dual<T>& a, const Dual<T>& b) {
  return {a.v * b.v, a.v * b.d + a.d * b.v};
}
template <class T>
Dual<T> operator/(const Dual<T>& a, const Dual<T>& b) {
  const T q = a.v / b.v;
  return {q, (a.d - q * b.d) / b.v};
}
#define DUAL(fn, slope)                                                                                  \
  template <class T>                                                                                     \
  Dual<T> fn(const Dual<T>& a) {                                                                         \
    using std::cos, std::cosh, std::exp, std::log, std::sin, std::sinh, std::sqrt, std::tanh, std::atan; \
    const T x = a.v, r = fn(x);                                                                          \
    return {r, a.d * (slope)};                                                                           \
  }
DUAL(sin, cos(x))
DUAL(exp, r)
DUAL(sinh, cosh(x))
DUAL(log, T(1.0) / x)
DUAL(sqrt, T(0.5) / r)
DUAL(tanh, T(1.0) - r * r)
DUAL(atan, T(1.0) / (T(1.0) + x * x))
#undef DUAL
template <class T>
Dual<T> cos(const Dual<T>& a) {
  using std::cos, std::sin;
  return {T(cos(a.v)), T(0.0) - a.d * sin(a.v)};
}
template <class T>
Dual<T> cosh(const Dual<T>& a) {
  using std::cosh, std::sinh;
  return {T(cosh(a.v)), a.d * sinh(a.v)};
}

enum class Step { kAdd, kSub, kMul, kDiv, kSin, kCos, kExp, kSinh, kCosh, kLog, kSqrt, kTanh, kAtan };
constexpr std::size_t kSteps = 13;

struct Expression {
  struct Line {
    Step step;
    std::size_t a, b;
  };
  std::size_t n_x = 0;
  std::vector<double> constants;
  std::vector<Line> lines;
};

template <class T>
T value_of(Step step, const T& a, const T& b) {
  using std::cos, std::cosh, std::exp, std::log, std::sin, std::sinh, std::sqrt, std::tanh, std::atan;
  switch (step) {
    case Step::kAdd:
      return a + b;
    case Step::kSub:
      return a - b;
    case Step::kMul:
      return a * b;
    case Step::kDiv:
      return a / b;
    case Step::kSin:
      return sin(a);
    case Step::kCos:
      return cos(a);
    case Step::kExp:
      return exp(a);
    case Step::kSinh:
      return sinh(a);
    case Step::kCosh:
      return cosh(a);
    case Step::kLog:
      return log(a);
    case Step::kSqrt:
      return sqrt(a);
    case Step::kTanh:
      return tanh(a);
    default:
      return atan(a);
  }
}

template <class T>
T run(const Expression& e, const std::vector<T>& x) {
  std::vector<T> v = x;
  for (const double c : e.constants) v.push_back(T(c));
  for (const auto& line : e.lines) v.push_back(value_of(line.step, v[line.a], v[line.b]));
  return v.back();
}

// A line is kept if its value is of moderate size and far from poles, zeros of quotients and branch cuts.
inline Expression random_expression(Random& random, const std::vector<std::complex<double>>& x,
                                    std::size_t lines) {
  Expression e{x.size(), {random.uniform(-2, 2), random.uniform(0.5, 2)}, {}};
  std::vector<std::complex<double>> v = x;
  for (const double c : e.constants) v.push_back(c);
  while (e.lines.size() < lines) {
    const auto step = static_cast<Step>(random.below(kSteps));
    const std::size_t last = e.lines.empty() ? random.below(v.size()) : v.size() - 1;  // all lines count
    const Expression::Line line{step, last, random.below(v.size())};
    const std::complex<double> a = v[line.a], b = v[line.b], r = value_of(step, a, b);
    const bool cut = (step == Step::kLog || step == Step::kSqrt) && (std::abs(a) < 0.3 || a.real() < 0);
    const bool pole = (step == Step::kDiv && std::abs(b) < 0.3) ||
                      (step == Step::kAtan && (std::abs(1.0 + a * a) < 0.3 || std::abs(a.imag()) > 0.7)) ||
                      (step == Step::kTanh && std::abs(std::cosh(a)) < 0.3);
    if (cut || pole || !(std::abs(r) < 8) || std::abs(r) < 0.02) continue;
    e.lines.push_back(line);
    v.push_back(r);
  }
  return e;
}

// First, second and third derivatives along directions, by nested duals.
template <class T>
T slope(const Expression& e, const std::vector<T>& x, const std::vector<T>& dx) {
  std::vector<Dual<T>> d;
  for (std::size_t j = 0; j < x.size(); ++j) d.push_back({x[j], dx[j]});
  return run(e, d).d;
}
template <class T>
T curvature(const Expression& e, const std::vector<T>& x, const std::vector<T>& dx,
            const std::vector<T>& dy) {
  std::vector<Dual<T>> at, along;
  for (std::size_t j = 0; j < x.size(); ++j) at.push_back({x[j], dy[j]}), along.push_back({dx[j], T(0.0)});
  return slope(e, at, along).d;
}
template <class T>
T third(const Expression& e, const std::vector<T>& x, const std::vector<T>& dx) {
  std::vector<Dual<T>> at, along;
  for (std::size_t j = 0; j < x.size(); ++j) at.push_back({x[j], dx[j]}), along.push_back({dx[j], T(0.0)});
  return curvature(e, at, along, along).d;
}

}  // namespace expressions
