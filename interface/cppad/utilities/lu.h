// SPDX-License-Identifier: BSD-3-Clause
//
// Solves linear equations by L U with pivots, for numbers or recorded values; matrices are row by row.
//
//   Scalar logdet;
//   const int sign = LuSolve(n, m, A, B, X, logdet);       // A X = B; det A = sign exp(logdet); 0: singular
// Numbers may be complex; another class of numbers needs AbsGeq(x, y) and LeqZero(x), found by its arguments.
// The pivots of recorded values are those of the recording point; they leave no guard.
#pragma once

#include <complex>
#include <string>
#include <utility>

#include <dyntape/interface/cppad/conditions.h>
#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

// Whether |x| >= |y|: how pivots are chosen.
template <Conditional S>
bool AbsGeq(const S& x, const S& y) {
  return abs_geq(x, y);
}
template <class Float>
bool AbsGeq(const std::complex<Float>& x, const std::complex<Float>& y) {
  return std::abs(x) >= std::abs(y);
}
// Whether x <= 0: the sign of a pivot then belongs to that of the determinant.
template <Conditional S>
bool LeqZero(const S& x) {
  return plain_value(x) <= 0;
}
template <class Float>
bool LeqZero(const std::complex<Float>& x) {
  return x == std::complex<Float>(0);
}

namespace detail {
// Before each step of elimination: at_pivot(step, pivot).
template <class SizeVector, class Vector, class AtPivot>
int factor(SizeVector& ip, SizeVector& jp, Vector& LU, AtPivot&& at_pivot) {
  using Scalar = std::remove_cvref_t<decltype(LU[0])>;
  const std::size_t n = ip.size();
  check_size("LuFactor: the size of LU", LU.size(), n * n);
  int sign = 1;
  for (std::size_t i = 0; i < n; ++i) ip[i] = jp[i] = i;
  for (std::size_t p = 0; p < n; ++p) {
    std::size_t row = p, col = p;
    for (std::size_t i = p; i < n; ++i) {
      for (std::size_t j = p; j < n; ++j) {
        if (!AbsGeq(LU[ip[row] * n + jp[col]], LU[ip[i] * n + jp[j]])) row = i, col = j;
      }
    }
    if (row != p) std::swap(ip[p], ip[row]), sign = -sign;
    if (col != p) std::swap(jp[p], jp[col]), sign = -sign;
    const Scalar pivot = LU[ip[p] * n + jp[p]];
    if (LeqZero(pivot) && LeqZero(Scalar(-pivot))) return 0;
    at_pivot(p, pivot);
    for (std::size_t j = p + 1; j < n; ++j) LU[ip[p] * n + jp[j]] = LU[ip[p] * n + jp[j]] / pivot;
    for (std::size_t i = p + 1; i < n; ++i) {
      for (std::size_t j = p + 1; j < n; ++j)
        LU[ip[i] * n + jp[j]] = LU[ip[i] * n + jp[j]] - LU[ip[i] * n + jp[p]] * LU[ip[p] * n + jp[j]];
    }
  }
  return sign;
}
}  // namespace detail

// Factors a matrix in place by elimination with full pivoting: L with the pivots on its diagonal and U with ones, of rows ip and columns
// jp.  Returns the sign of the permutations, 0 if the matrix is singular.
template <class SizeVector, class Vector>
int LuFactor(SizeVector& ip, SizeVector& jp, Vector& LU) {
  return detail::factor(ip, jp, LU, [](std::size_t, const auto&) {});
}

// The same of recorded values.  ratio: the largest quotient, over all steps, of the largest element that was left and of the pivot, so 1
// where pivots are chosen, and larger where the recorded ones no longer are the best (infinite: a pivot has become zero).
template <class SizeVector, class Vector, class Scalar>
int LuRatio(SizeVector& ip, SizeVector& jp, Vector& LU, Scalar& ratio) {
  const std::size_t n = ip.size();
  ratio = Scalar(1);
  return detail::factor(ip, jp, LU, [&](std::size_t p, const auto& pivot) {
    using std::abs;
    Scalar largest(0);
    for (std::size_t i = p; i < n; ++i) {
      for (std::size_t j = p; j < n; ++j) {
        const Scalar size = abs(LU[ip[i] * n + jp[j]]);
        largest = CondExpGt(size, largest, size, largest);
      }
    }
    const Scalar quotient = largest / abs(pivot);
    ratio = CondExpGt(quotient, ratio, quotient, ratio);
  });
}

// Of what LuFactor made: B becomes X.
template <class SizeVector, class Vector>
void LuInvert(const SizeVector& ip, const SizeVector& jp, const Vector& LU, Vector& B) {
  using Scalar = std::remove_cvref_t<decltype(LU[0])>;
  const std::size_t n = ip.size(), m = n ? B.size() / n : 0;
  vector<Scalar> x(n);
  for (std::size_t k = 0; k < m; ++k) {
    for (std::size_t p = 0; p < n; ++p) {
      Scalar sum = B[ip[p] * m + k];
      for (std::size_t j = 0; j < p; ++j) sum = sum - LU[ip[p] * n + jp[j]] * x[j];
      x[p] = sum / LU[ip[p] * n + jp[p]];
    }
    for (std::size_t p = n; p-- > 0;) {
      for (std::size_t j = p + 1; j < n; ++j) x[p] = x[p] - LU[ip[p] * n + jp[j]] * x[j];
    }
    for (std::size_t p = 0; p < n; ++p) B[jp[p] * m + k] = x[p];
  }
}

template <class Scalar, class Vector>
int LuSolve(std::size_t n, std::size_t m, const Vector& A, const Vector& B, Vector& X, Scalar& logdet) {
  detail::check_size("LuSolve: the size of A", A.size(), n * n);
  detail::check_size("LuSolve: the size of B", B.size(), n * m);
  vector<std::size_t> ip(n), jp(n);
  Vector LU = A;
  logdet = Scalar(0);
  int sign = LuFactor(ip, jp, LU);
  if (sign == 0) return 0;
  for (std::size_t p = 0; p < n; ++p) {
    const Scalar pivot = LU[ip[p] * n + jp[p]];
    const bool negative = LeqZero(pivot);
    if (negative) sign = -sign;
    using std::log;
    logdet = logdet + log(negative ? Scalar(-pivot) : pivot);
  }
  X = B;
  LuInvert(ip, jp, LU, X);
  return sign;
}

}  // namespace CppAD::inline dyntape_names
