// SPDX-License-Identifier: BSD-3-Clause
//
// Truncated power series as a number type: Taylor coefficients of any order, by the rules of ops.def.
//
//   using S = Series<double>;
//   S t = S::of({2.0, 1.0, 0.0, 0.0});       // 2 + t, up to order 3
//   S y = sin(t) / t;
//   y[2]                                     // a Taylor coefficient: the second derivative over 2
//
// No operator has a rule here.  The value is that of the table; higher coefficients follow from the slopes of the
// table: k y_k is coefficient k - 1 of the slope series times dx/dt.  A new row of the table has series of any order
// without further code.  Four rows of inner loops (Mul, Div, Exp, Sqrt) use the usual recurrences.
//
// A series of one coefficient is a constant: its other coefficients are zero by structure, so 0 * inf does not
// occur.  A series without coefficients is "nothing": adding it changes nothing, and a product with it is nothing.
// Therefore branches of a select that are not taken, values that do not move and values without weight contribute
// exactly zero, as in derived graphs (Poles, in ops.def).
//
// T is a float, or a type with a specialisation of SeriesNumber, such as a recorded coefficient.
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

// The operations of a coefficient besides + - * /.
template <class T>
struct SeriesNumber {
  // Whether conditions have a value now; recorded conditions do not.
  static constexpr bool kKnown = true;
  static T evaluate(Op op, const T& x, const T& y, const T& z) { return dyntape::evaluate<T>(op, x, y, z); }
  static bool is_zero(const T& x) { return x == T(0); }
};

template <class T>
class Series {
 public:
  Series() = default;  // nothing
  explicit Series(double constant) : size_(1) { few_[0] = T(constant); }
  static Series constant(const T& value) {
    Series s;
    s.resize(1);
    s[0] = value;
    return s;
  }
  void become(const T& constant) { size_ = 1, gated_ = false, few_[0] = constant; }
  void become_nothing() { size_ = 0, gated_ = false; }
  static Series of(std::initializer_list<T> coefficients) {
    Series s;
    s.resize(coefficients.size());
    std::copy(coefficients.begin(), coefficients.end(), s.data());
    return s;
  }
  static Series zeros(std::size_t size) {
    Series s;
    s.resize(size);
    std::fill_n(s.data(), size, T(0));
    return s;
  }

  Series(const Series& other) { *this = other; }
  Series(Series&& other) noexcept = default;
  Series& operator=(Series&& other) noexcept = default;
  Series& operator=(const Series& other) {
    if (this == &other) return *this;
    resize(other.size_);
    std::copy_n(other.data(), size_, data());
    gated_ = other.gated_;
    return *this;
  }

  std::size_t size() const { return size_; }
  bool is_nothing() const { return size_ == 0; }
  bool moves() const { return size_ > 1; }
  const T& operator[](std::size_t k) const { return data()[k]; }
  T& operator[](std::size_t k) { return data()[k]; }
  // Coefficient k; zero after the last coefficient.
  T at(std::size_t k) const { return k < size_ ? data()[k] : T(0); }
  // resize() leaves new coefficients without values.
  void resize(std::size_t size) {
    if (size > kFew && (size > room_ || !more_)) more_ = std::make_unique<T[]>(size), room_ = size;
    size_ = size;
  }
  Series first(std::size_t n) const {
    Series s;
    s.resize(std::min(n, size_));
    std::copy_n(data(), s.size_, s.data());
    s.gated_ = gated_;
    return s;
  }

  // Marks an adjoint with recorded coefficients that may turn out zero: a zero then outweighs infinities.
  bool is_gated() const { return gated_; }
  Series&& gated(bool yes = true) && { return gated_ = yes, std::move(*this); }

 private:
  static constexpr std::size_t kFew = 3;  // orders 0 to 2 need no memory from the heap

  const T* data() const { return size_ > kFew ? more_.get() : few_; }
  T* data() { return size_ > kFew ? more_.get() : few_; }

  std::size_t size_ = 0, room_ = 0;
  bool gated_ = false;
  T few_[kFew]{};
  std::unique_ptr<T[]> more_;
};

// Applies an operator; ignores arguments beyond its arity.
template <class T>
Series<T> evaluate_series(Op op, const Series<T>& x, const Series<T>& y, const Series<T>& z);

// Functions of the table by name, as the cells of the table call them.
#define OP(name, fn, n, ...) DYNTAPE_SERIES_##n(name, fn)
#define DYNTAPE_SERIES_1(name, fn)             \
  template <class T>                           \
  Series<T> fn(const Series<T>& x) {           \
    return evaluate_series(Op::name, x, x, x); \
  }
#define DYNTAPE_SERIES_2(name, fn)                       \
  template <class T>                                     \
  Series<T> fn(const Series<T>& x, const Series<T>& y) { \
    return evaluate_series(Op::name, x, y, x);           \
  }
#define DYNTAPE_SERIES_3(name, fn)                                           \
  template <class T>                                                         \
  Series<T> fn(const Series<T>& x, const Series<T>& y, const Series<T>& z) { \
    return evaluate_series(Op::name, x, y, z);                               \
  }
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_SERIES_1
#undef DYNTAPE_SERIES_2
#undef DYNTAPE_SERIES_3

template <class T>
Series<T> operator<(const Series<T>& x, const Series<T>& y) {
  return less(x, y);
}
template <class T>
Series<T> operator>(const Series<T>& x, const Series<T>& y) {
  return less(y, x);
}
template <class T>
Series<T> operator==(const Series<T>& x, const Series<T>& y) {
  return equal(x, y);
}

}  // namespace dyntape

#include <dyntape/autodiff/evaluate/series.hxx>
