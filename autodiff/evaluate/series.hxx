// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

namespace dyntape {

namespace detail {

// What series of these sizes make together: none of nothing, and constants are as long as what they meet.
template <class T>
std::size_t common_size(const Series<T>& a, const Series<T>& b) {
  if (a.is_nothing() || b.is_nothing()) return 0;
  return !a.moves() ? b.size() : !b.moves() ? a.size() : std::min(a.size(), b.size());
}

template <class T>
T product_of(bool gated, const T& a, const T& b) {
  if constexpr (!SeriesNumber<T>::kKnown) {
    if (gated) return SeriesNumber<T>::evaluate(Op::Azmul, a, b, a);
  }
  return a * b;
}

// Coefficient by coefficient, so that one of a which is zero outweighs what it meets.
template <class T>
Series<T> absolute_product(const Series<T>& a, const Series<T>& b) {
  Series<T> r;
  r.resize(common_size(a, b));
  for (std::size_t k = 0; k < r.size(); ++k) {
    const std::size_t first = b.moves() ? 0 : k, last = a.moves() ? k : 0;
    r[k] = T(0);
    for (std::size_t j = first; j <= last; ++j)
      r[k] = r[k] + SeriesNumber<T>::evaluate(Op::Azmul, a[j], b[k - j], a[j]);
  }
  return r;
}

template <class T>
T quotient_of(bool gated, const T& a, const T& b) {
  if constexpr (!SeriesNumber<T>::kKnown) {
    if (gated) return SeriesNumber<T>::evaluate(Op::Azmul, a, T(1) / b, a);
  }
  return a / b;
}

template <class T>
Series<T> product(const Series<T>& a, const Series<T>& b) {
  if (b.is_gated() && !a.is_gated()) return product(b, a);
  Series<T> r;
  r.resize(common_size(a, b));
  const bool gated = a.is_gated();
  for (std::size_t k = 0; k < r.size(); ++k) {
    const std::size_t first = b.moves() ? 0 : k, last = a.moves() ? k : 0;
    r[k] = product_of(gated, a[first], b[k - first]);
    for (std::size_t j = first + 1; j <= last; ++j) r[k] = r[k] + product_of(gated, a[j], b[k - j]);
  }
  return std::move(r).gated(gated);
}

template <class T>
Series<T> quotient(const Series<T>& a, const Series<T>& b) {
  Series<T> r;
  r.resize(common_size(a, b));
  const bool gated = a.is_gated();
  for (std::size_t k = 0; k < r.size(); ++k) {
    if (k == 0 || !b.moves()) {
      r[k] = quotient_of(gated, a[k], b[0]);
      continue;
    }
    T rest = product_of(gated, r[0], b[k]);
    for (std::size_t j = 1; j < k; ++j) rest = rest + product_of(gated, r[j], b[k - j]);
    r[k] = quotient_of(gated, k < a.size() ? a[k] - rest : -rest, b[0]);
  }
  return std::move(r).gated(gated);
}

// a + sign b.
template <class T>
Series<T> sum(const Series<T>& a, const Series<T>& b, bool minus) {
  if (b.is_nothing()) return a;
  const bool gated = a.is_gated() || b.is_gated();
  Series<T> r;
  r.resize(a.is_nothing() ? b.size() : common_size(a, b));
  for (std::size_t k = 0; k < r.size(); ++k) {
    const bool in_a = k < a.size(), in_b = k < b.size();
    r[k] = !in_b ? a[k] : !in_a ? (minus ? T(-b[k]) : b[k]) : minus ? T(a[k] - b[k]) : T(a[k] + b[k]);
  }
  return std::move(r).gated(gated);
}

template <class T>
Series<T> negative(const Series<T>& a) {
  Series<T> r;
  r.resize(a.size());
  for (std::size_t k = 0; k < r.size(); ++k) r[k] = -a[k];
  return std::move(r).gated(a.is_gated());
}

// v where `passes`, coefficient by coefficient where the condition is recorded; nothing where it is known not to.
template <class T>
Series<T> passed(const Series<T>& condition, const Series<T>& v, bool when) {
  if (v.is_nothing()) return v;
  if constexpr (SeriesNumber<T>::kKnown) {
    return !SeriesNumber<T>::is_zero(condition[0]) == when ? v : Series<T>();
  } else {
    Series<T> r;
    r.resize(v.size());
    for (std::size_t k = 0; k < r.size(); ++k) {
      r[k] = SeriesNumber<T>::evaluate(Op::Select, condition[0], when ? v[k] : T(0), when ? T(0) : v[k]);
    }
    return std::move(r).gated(v.is_gated());
  }
}

// dx/dt, to the given number of coefficients.
template <class T>
Series<T> rate(const Series<T>& x, std::size_t n) {
  Series<T> r;
  if (!x.moves()) return r;
  r.resize(std::min(n, x.size() - 1));
  for (std::size_t k = 0; k < r.size(); ++k) r[k] = k == 0 ? x[1] : T(x[k + 1] * T(double(k + 1)));
  return r;
}

// Arguments that move and pass something on.
template <class T>
struct SeriesArguments {
  Op op;
  const Series<T>* of[3];

  bool moves(int i) const { return has_slope(op, i) && of[i]->moves(); }
  // Whether the first coefficient is a sum of slopes in numbers: what passes on conditions, or does not move although it is a series, is
  // no number.
  bool slopes_are_numbers() const {
    if (op == Op::Min || op == Op::Max || op == Op::Select) return false;
    for (int i = 0; i < info(op).arity; ++i) {
      if (moves(i) && SeriesNumber<T>::is_zero((*of[i])[1])) return false;
    }
    return true;
  }
  T first_slope(const T& value) const {
    T sum(0);
    bool any = false;
    for (int i = 0; i < info(op).arity; ++i) {
      if (!moves(i)) continue;
      const T s = slope<T>(op, i, (*of[0])[0], (*of[1])[0], (*of[2])[0], value, (*of[i])[1]);
      sum = any ? T(sum + s) : s;
      any = true;
    }
    return sum;
  }
  // The sum of the slopes times v_i, with arguments and result to n coefficients.
  template <class Direction>
  Series<T> passage(std::size_t n, const Series<T>& r, Direction&& v) const {
    const Series<T> x = of[0]->first(n), y = of[1]->first(n), z = of[2]->first(n);
    Series<T> s;
    for (int i = 0; i < info(op).arity; ++i) {
      if (moves(i)) s = sum(s, slope<Series<T>>(op, i, x, y, z, r, v(*of[i])), false);
    }
    return s;
  }
};

// Cells that multiply by nothing but 1 and -1: each coefficient goes its own way.
template <class T>
Series<T> linear_series(const SeriesArguments<T>& a, const T& value, std::size_t n) {
  Series<T> r = a.passage(n, Series<T>::constant(value), [](const Series<T>& x) {
    Series<T> without_value = x;
    without_value[0] = T(0);
    return without_value;
  });
  if (r.is_nothing()) r.resize(1);
  r[0] = value;
  return r;
}

template <class T>
Series<T> integrated(const T& value, const Series<T>& rates, std::size_t n) {
  if (rates.is_nothing()) return Series<T>::constant(value);
  Series<T> r;
  r.resize(n);
  r[0] = value;
  for (std::size_t k = 1; k < n; ++k) r[k] = k == 1 ? rates.at(0) : T(rates.at(k - 1) / T(double(k)));
  return r;
}

// Slopes that are made of the result itself: it grows by one coefficient at a time.
template <class T>
Series<T> grown_series(const SeriesArguments<T>& a, const T& value, std::size_t n) {
  Series<T> r = Series<T>::constant(value);
  for (std::size_t k = 1; k < n; ++k) {
    const Series<T> rates = a.passage(k, r, [&](const Series<T>& x) { return rate(x, k); });
    if (rates.is_nothing()) return r;
    Series<T> longer = Series<T>::zeros(k + 1);
    for (std::size_t j = 0; j < k; ++j) longer[j] = r[j];
    longer[k] = k == 1 ? rates.at(0) : T(rates.at(k - 1) / T(double(k)));
    r = std::move(longer);
  }
  return r;
}

template <class T>
Series<T> series_by_slopes(const SeriesArguments<T>& a, const T& value, std::size_t n) {
  bool scales = false, mentions_result = false;
  for (int i = 0; i < info(a.op).arity; ++i) {
    if (!a.moves(i)) continue;
    scales = scales || ops::slope_cell(a.op, i).scales;
    mentions_result = mentions_result || (ops::slope_cell(a.op, i).mentions & 8u);
  }
  if (!scales) return linear_series(a, value, n);
  if (mentions_result) return grown_series(a, value, n);
  const Series<T> rates =
      a.passage(n - 1, Series<T>::constant(value), [&](const Series<T>& x) { return rate(x, n - 1); });
  return integrated(value, rates, n);
}

template <class T>
Series<T> exp_series(const Series<T>& x, const T& value) {
  Series<T> r;
  r.resize(x.size());
  r[0] = value;
  for (std::size_t k = 1; k < r.size(); ++k) {
    T s = x[1] * r[k - 1];
    for (std::size_t j = 2; j <= k; ++j) s = s + T(double(j)) * x[j] * r[k - j];
    r[k] = k == 1 ? s : T(s / T(double(k)));
  }
  return r;
}

template <class T>
Series<T> sqrt_series(const Series<T>& x, const T& value) {
  Series<T> r;
  r.resize(x.size());
  r[0] = value;
  const T slope = T(0.5) / value;
  for (std::size_t k = 1; k < r.size(); ++k) {
    T rest = x[k];
    for (std::size_t j = 1; j < k; ++j) rest = rest - r[j] * r[k - j];
    r[k] = product_of(true, rest, slope);
  }
  return r;
}

// x^y with an exponent that moves, at a base whose logarithm is a number.
template <class T>
Series<T> power_series(const Series<T>& x, const Series<T>& y, const T& value) {
  Series<T> r = exp_series(Series<T>(y * log(x)), value);
  return r;
}

template <class T>
bool has_logarithm(const Series<T>& x) {
  if constexpr (SeriesNumber<T>::kKnown) return x[0] > T(0);
  return false;
}

}  // namespace detail

template <class T>
Series<T> where(const Series<T>& condition, const Series<T>& v) {
  return detail::passed(condition, v, true);
}
template <class T>
Series<T> unless(const Series<T>& condition, const Series<T>& v) {
  return detail::passed(condition, v, false);
}
// Where conditions are known, what does not move or weigh is nothing; else its zero outweighs the pole.
template <class T>
Series<T> at_pole(const Series<T>& v, const Series<T>& s) {
  if constexpr (SeriesNumber<T>::kKnown) return detail::product(v, s);
  return detail::product(Series<T>(v).gated(true), s).gated(v.is_gated());
}

template <class T>
Series<T> evaluate_series(Op op, const Series<T>& x, const Series<T>& y, const Series<T>& z) {
  switch (op) {
    case Op::Add:
      return detail::sum(x, y, false);
    case Op::Sub:
      return detail::sum(x, y, true);
    case Op::Neg:
      return detail::negative(x);
    case Op::Mul:
      return detail::product(x, y);
    case Op::Div:
      return detail::quotient(x, y);
    case Op::Azmul:
      return detail::absolute_product(x, y);
    case Op::Gate:
      return detail::passed(x, y, true);
    default:
      break;
  }
  const detail::SeriesArguments<T> arguments{op, {&x, &y, &z}};
  const T value = SeriesNumber<T>::evaluate(op, x[0], y[0], z[0]);
  std::size_t n = 1;
  for (int i = 0; i < info(op).arity; ++i) {
    if (!arguments.moves(i)) continue;
    const std::size_t size = arguments.of[i]->size();
    n = n == 1 ? size : std::min(n, size);
  }
  if (n == 1) return Series<T>::constant(value);
  if constexpr (SeriesNumber<T>::kKnown) {
    if (n == 2 && arguments.slopes_are_numbers()) {
      Series<T> r = Series<T>::constant(value);
      r.resize(2);
      r[1] = arguments.first_slope(value);
      return r;
    }
  }
  if (op == Op::Exp) return detail::exp_series(x, value);
  if (op == Op::Sqrt) return detail::sqrt_series(x, value);
  if (op == Op::Pow && y.moves() && detail::has_logarithm(x)) return detail::power_series(x, y, value);
  return detail::series_by_slopes(arguments, value, n);
}

}  // namespace dyntape
