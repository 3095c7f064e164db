// SPDX-License-Identifier: BSD-3-Clause
//
// Polynomials, integrals, sorting, and numbers as text.
//
//   Poly(k, a, z)                      the k-th derivative of a[0] + a[1] z + ... at z
//   RombergOne(F, a, b, n, p, e)       the integral of F from a to b by up to 2^(n - 1) intervals; e: an estimate of its error
//   RombergMul(F, a, b, n, p, e)       of F of several arguments, over a box
#pragma once

#include <cstddef>
#include <set>
#include <sstream>
#include <string>

#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

template <class Type, class Vector>
Type Poly(std::size_t k, const Vector& a, const Type& z) {
  Type sum(0);
  for (std::size_t i = a.size(); i-- > k;) {
    double factor = 1;
    for (std::size_t j = i - k + 1; j <= i; ++j) factor *= double(j);
    sum = sum * z + Type(factor) * Type(a[i]);
  }
  return sum;
}

namespace detail {
inline std::size_t least(std::size_t a, std::size_t b) { return a < b ? a : b; }
}  // namespace detail

// Trapezoids of n step sizes, each half of the one before, extrapolated min(p, n - 1) times.  e: by how much the last step size changed
// the result, which is by all of it where there is only one.
template <class Fun, class Float>
Float RombergOne(Fun& F, const Float& a, const Float& b, std::size_t n, std::size_t p, Float& e) {
  if (n == 0 || n < p)
    detail::refuse("RombergOne: n is " + std::to_string(n) +
                   ", expected at least 1 and p = " + std::to_string(p));
  vector<Float> row(p + 1);
  Float step = b - a, before(0);
  row[0] = (F(a) + F(b)) * step / Float(2);
  for (std::size_t i = 1, intervals = 1; i < n; ++i, intervals *= 2) {
    Float middle(0);
    for (std::size_t k = 0; k < intervals; ++k) middle = middle + F(a + step * Float(double(k) + 0.5));
    before = row[detail::least(i - 1, p)];
    Float left = row[0], power(4);
    row[0] = (row[0] + middle * step) / Float(2);
    step = step / Float(2);
    for (std::size_t j = 1; j <= detail::least(i, p); ++j) {
      const Float next = row[j];
      row[j] = row[j - 1] + (row[j - 1] - left) / (power - Float(1));
      left = next;
      power = power * Float(4);
    }
  }
  const Float integral = row[detail::least(n - 1, p)], apart = integral - before;
  e = apart < Float(0) ? Float(-apart) : apart;
  return integral;
}

namespace detail {

// F with all arguments but the first given, integrated over the first.
template <class Fun, class Vector, class SizeVector>
struct Slice {
  using Float = std::remove_cvref_t<decltype(std::declval<Vector&>()[0])>;
  Fun& F;
  const Vector &a, &b;
  const SizeVector &n, &p;
  Vector& x;
  std::size_t axis;
  Float* error;

  Float operator()(const Float& value) {
    x[axis] = value;
    if (axis + 1 == std::size_t(a.size())) return F(x);
    Slice inner{F, a, b, n, p, x, axis + 1, error};
    Float e;
    const Float integral = RombergOne(inner, a[axis + 1], b[axis + 1], n[axis + 1], p[axis + 1], e);
    Float share = e;
    for (std::size_t k = 0; k <= axis; ++k) share = share * (b[k] - a[k]);
    if (*error < share) *error = share;
    return integral;
  }
};

}  // namespace detail

// CppAD writes RombergMul as a class with call operator.
template <class Fun, class SizeVector, class FloatVector, std::size_t m>
struct RombergMul {
  using Float = std::remove_cvref_t<decltype(std::declval<FloatVector&>()[0])>;
  Float operator()(Fun& F, const FloatVector& a, const FloatVector& b, const SizeVector& n,
                   const SizeVector& p, Float& e) {
    FloatVector x(m);
    Float inner(0), outer;
    detail::Slice<Fun, FloatVector, SizeVector> slice{F, a, b, n, p, x, 0, &inner};
    const Float integral = RombergOne(slice, a[0], b[0], n[0], p[0], outer);
    e = outer + inner;
    return integral;
  }
};

// ind: the order in which keys ascend, equal ones as they stand.
template <class KeyVector, class SizeVector>
void index_sort(const KeyVector& keys, SizeVector& ind) {
  const std::size_t n = std::size_t(keys.size());
  vector<std::size_t> places(n), merged(n);
  for (std::size_t i = 0; i < n; ++i) places[i] = i;
  for (std::size_t run = 1; run < n; run *= 2) {  // sorted runs of this length become one of twice
    for (std::size_t first = 0; first < n; first += 2 * run) {
      const std::size_t middle = detail::least(first + run, n), last = detail::least(first + 2 * run, n);
      std::size_t a = first, b = middle;
      for (std::size_t k = first; k < last; ++k) {
        const bool from_a = b == last || (a < middle && !(keys[places[b]] < keys[places[a]]));
        merged[k] = from_a ? places[a++] : places[b++];
      }
    }
    places.swap(merged);
  }
  for (std::size_t i = 0; i < n; ++i) ind[i] = places[i];
}

// A number with one digit more than its type keeps of any.  Programs specialise it for their bases.
template <class Value>
struct to_string_struct {
  std::string operator()(const Value& value) {
    std::ostringstream text;
    text.precision(1 + numeric_limits<Value>::digits10);
    text << detail::given(value);
    return text.str();
  }
};
template <class Base>
struct to_string_struct<AD<Base>> : to_string_struct<Base> {
  std::string operator()(const AD<Base>& x) { return to_string_struct<Base>::operator()(x.value()); }
};
template <class Value>
std::string to_string(const Value& value) {
  return to_string_struct<Value>()(value);
}

// The elements of either.
template <class Element>
std::set<Element> set_union(const std::set<Element>& left, const std::set<Element>& right) {
  std::set<Element> both = left;
  both.insert(right.begin(), right.end());
  return both;
}

}  // namespace CppAD::inline dyntape_names
