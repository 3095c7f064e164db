// SPDX-License-Identifier: BSD-3-Clause
//
// Exact rational numbers of 64 bits, and linear questions about them: is there an x >= 0 with M x = r, and of what rank is M?
//
//   FractionSystem s({true, false});          // x_0 of any sign, x_1 >= 0
//   s.row({1, 1}, 2);                         // x_0 + x_1 = 2
//   s.solution()                              // one of them, or none
//
// Errors: std::overflow_error where 64 bits do not hold a fraction.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <vector>

namespace dyntape::testing {

class Fraction {
 public:
  Fraction(std::int64_t n = 0) : n_(n) {}
  friend Fraction operator+(Fraction a, Fraction b) {
    return of(Wide(a.n_) * b.d_ + Wide(b.n_) * a.d_, Wide(a.d_) * b.d_);
  }
  friend Fraction operator-(Fraction a, Fraction b) {
    return of(Wide(a.n_) * b.d_ - Wide(b.n_) * a.d_, Wide(a.d_) * b.d_);
  }
  friend Fraction operator*(Fraction a, Fraction b) { return of(Wide(a.n_) * b.n_, Wide(a.d_) * b.d_); }
  friend Fraction operator/(Fraction a, Fraction b) {
    return b.n_ < 0 ? of(-Wide(a.n_) * b.d_, -Wide(a.d_) * b.n_) : of(Wide(a.n_) * b.d_, Wide(a.d_) * b.n_);
  }
  Fraction operator-() const { return of(-Wide(n_), d_); }
  int sign() const { return n_ > 0 ? 1 : n_ < 0 ? -1 : 0; }
  double value() const { return double(n_) / double(d_); }

 private:
  __extension__ using Wide = __int128;
  static Fraction of(Wide n, Wide d) {
    Wide a = n < 0 ? -n : n, b = d;
    while (b != 0) {
      const Wide rest = a % b;
      a = b, b = rest;
    }
    if (a > 1) n /= a, d /= a;
    const Fraction f{static_cast<std::int64_t>(n), static_cast<std::int64_t>(d)};
    if (f.n_ != n || f.d_ != d) throw std::overflow_error("fractions beyond 64 bits");
    return f;
  }
  Fraction(std::int64_t n, std::int64_t d) : n_(n), d_(d) {}
  std::int64_t n_, d_ = 1;
};

using Fractions = std::vector<Fraction>;
using FractionRows = std::vector<Fractions>;

// x >= 0 with M x = r, by the simplex method with Bland's rule.
inline std::optional<Fractions> nonnegative_solution(FractionRows M, Fractions r, std::size_t n) {
  const std::size_t m = M.size();
  std::vector<std::size_t> basis(m);
  for (std::size_t i = 0; i < m; ++i) {  // artificial variables n, n + 1, ..., whose columns are not kept
    if (r[i].sign() < 0) {
      r[i] = -r[i];
      for (Fraction& entry : M[i]) entry = -entry;
    }
    basis[i] = n + i;
  }
  for (;;) {
    std::size_t in = n;  // the first column whose taking in lets the sum of artificial variables fall
    for (std::size_t j = 0; j < n && in == n; ++j) {
      Fraction rate;
      for (std::size_t i = 0; i < m; ++i)
        if (basis[i] >= n) rate = rate + M[i][j];
      if (rate.sign() > 0) in = j;
    }
    if (in == n) break;
    std::size_t out = m;
    for (std::size_t i = 0; i < m; ++i) {
      if (M[i][in].sign() <= 0) continue;
      const int order = out == m ? -1 : (r[i] * M[out][in] - r[out] * M[i][in]).sign();
      if (order < 0 || (order == 0 && basis[i] < basis[out])) out = i;
    }
    const Fraction pivot = M[out][in];
    for (Fraction& entry : M[out]) entry = entry / pivot;
    r[out] = r[out] / pivot;
    for (std::size_t i = 0; i < m; ++i) {
      const Fraction by = M[i][in];
      if (i == out || by.sign() == 0) continue;
      for (std::size_t j = 0; j < n; ++j)
        if (M[out][j].sign() != 0) M[i][j] = M[i][j] - by * M[out][j];
      r[i] = r[i] - by * r[out];
    }
    basis[out] = in;
  }
  Fractions x(n);
  for (std::size_t i = 0; i < m; ++i) {
    if (basis[i] >= n && r[i].sign() != 0) return std::nullopt;
    if (basis[i] < n) x[basis[i]] = r[i];
  }
  return x;
}

// Equations in variables some of which may have any sign.
class FractionSystem {
 public:
  explicit FractionSystem(std::vector<bool> is_free) : is_free_(std::move(is_free)) {}
  void row(Fractions entries, Fraction side) { rows_.push_back(std::move(entries)), sides_.push_back(side); }
  std::optional<Fractions> solution() const {
    FractionRows M;
    for (const Fractions& row : rows_) {
      Fractions split;
      for (std::size_t j = 0; j < row.size(); ++j) {
        split.push_back(row[j]);
        if (is_free_[j]) split.push_back(-row[j]);
      }
      M.push_back(split);
    }
    std::size_t n = 0;
    for (bool is_free : is_free_) n += is_free ? 2 : 1;
    const auto z = nonnegative_solution(M, sides_, n);
    if (!z) return std::nullopt;
    Fractions x;
    for (std::size_t j = 0, k = 0; j < is_free_.size(); ++j) {
      x.push_back(is_free_[j] ? (*z)[k] - (*z)[k + 1] : (*z)[k]);
      k += is_free_[j] ? 2 : 1;
    }
    return x;
  }

 private:
  std::vector<bool> is_free_;
  FractionRows rows_;
  Fractions sides_;
};

inline Fraction dot(const Fractions& a, const Fractions& b) {
  Fraction sum;
  for (std::size_t i = 0; i < a.size(); ++i) sum = sum + a[i] * b[i];
  return sum;
}

inline std::size_t rank_of(FractionRows M) {
  std::size_t rank = 0;
  for (std::size_t j = 0; !M.empty() && j < M[0].size(); ++j) {
    std::size_t p = rank;
    while (p < M.size() && M[p][j].sign() == 0) ++p;
    if (p == M.size()) continue;
    std::swap(M[p], M[rank]);
    for (std::size_t i = rank + 1; i < M.size(); ++i) {
      const Fraction by = M[i][j] / M[rank][j];
      for (std::size_t k = j; k < M[i].size(); ++k) M[i][k] = M[i][k] - by * M[rank][k];
    }
    ++rank;
  }
  return rank;
}

}  // namespace dyntape::testing
