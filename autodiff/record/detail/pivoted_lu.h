// SPDX-License-Identifier: BSD-3-Clause
//
// LU with partial pivoting by selection (Golub and Van Loan, 3.4), for any scalar.  Rows are exchanged under
// recorded conditions, so that every evaluation chooses its pivots, and the recording has no guard.
//
// Step k moves the largest entry of column k, from the diagonal down, to the diagonal: n - k - 1 comparisons, each
// with a conditional swap of the rest of two rows.  Then it eliminates the entries below:
//
//   A = S_0 M_0^-1 S_1 M_1^-1 ... U,   S_k a product of swaps, M_k = I - m_k e_k^T
//
// Multipliers m_k stay at the place of their step (as in LINPACK's dgefa); later swaps do not move them.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <deque>
#include <utility>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape::detail {

template <class T>
using DynamicMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;

template <class Condition, class T>
void swap_where(const Condition& condition, T& a, T& b) {
  using ops::select;
  const T kept = a;
  a = select(condition, b, kept);
  b = select(condition, kept, b);
}

template <class T>
struct PivotedLu {
  using Truth = std::decay_t<decltype(std::declval<T>() > std::declval<T>())>;
  DynamicMatrix<T> lu;      // U on the diagonal and above, m_k below it
  std::deque<Truth> swaps;  // of rows k and i, for each i > k, step by step
  T sign = T(1);            // of the permutation
};

template <class T>
PivotedLu<T> pivoted_lu(const DynamicMatrix<T>& m) {
  using ops::select;
  using std::abs;
  PivotedLu<T> f{m, {}};
  auto& a = f.lu;
  const Eigen::Index n = a.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    for (Eigen::Index i = k + 1; i < n; ++i) {
      f.swaps.push_back(abs(a(i, k)) > abs(a(k, k)));
      for (Eigen::Index j = k; j < n; ++j) swap_where(f.swaps.back(), a(k, j), a(i, j));
      f.sign = select(f.swaps.back(), T(-f.sign), f.sign);
    }
    for (Eigen::Index i = k + 1; i < n; ++i) {
      a(i, k) = a(i, k) / a(k, k);
      for (Eigen::Index j = k + 1; j < n; ++j) a(i, j) -= a(i, k) * a(k, j);
    }
  }
  return f;
}

// Solves A x = b column by column; x replaces b.
template <class T>
void solve_in_place(const PivotedLu<T>& f, DynamicMatrix<T>& x) {
  const auto& a = f.lu;
  const Eigen::Index n = a.rows();
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    auto swap = f.swaps.begin();
    for (Eigen::Index k = 0; k < n; ++k) {
      for (Eigen::Index i = k + 1; i < n; ++i) swap_where(*swap++, x(k, c), x(i, c));
      for (Eigen::Index i = k + 1; i < n; ++i) x(i, c) -= a(i, k) * x(k, c);
    }
    for (Eigen::Index k = n; k-- > 0;) {
      for (Eigen::Index j = k + 1; j < n; ++j) x(k, c) -= a(k, j) * x(j, c);
      x(k, c) /= a(k, k);
    }
  }
}

// Solves A^T x = b: the transposed factors in reverse order.
template <class T>
void solve_transposed_in_place(const PivotedLu<T>& f, DynamicMatrix<T>& x) {
  const auto& a = f.lu;
  const Eigen::Index n = a.rows();
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    for (Eigen::Index k = 0; k < n; ++k) {
      for (Eigen::Index j = 0; j < k; ++j) x(k, c) -= a(j, k) * x(j, c);
      x(k, c) /= a(k, k);
    }
    auto swap = f.swaps.end();
    for (Eigen::Index k = n; k-- > 0;) {
      for (Eigen::Index i = k + 1; i < n; ++i) x(k, c) -= a(i, k) * x(i, c);
      for (Eigen::Index i = n; i-- > k + 1;) swap_where(*--swap, x(k, c), x(i, c));
    }
  }
}

// n <= 4: a sum of cofactors, a polynomial without division.  n > 4: the product of the pivots.
template <class T>
T determinant_of(const DynamicMatrix<T>& a) {
  const auto minor = [&](int i, int j, int c, int d) { return a(i, c) * a(j, d) - a(i, d) * a(j, c); };
  switch (a.rows()) {
    case 0:
      return T(1);
    case 1:
      return a(0, 0);
    case 2:
      return minor(0, 1, 0, 1);
    case 3:
      return a(0, 0) * minor(1, 2, 1, 2) - a(0, 1) * minor(1, 2, 0, 2) + a(0, 2) * minor(1, 2, 0, 1);
    case 4:  // of the upper two rows times of the lower two (Laplace)
      return minor(0, 1, 0, 1) * minor(2, 3, 2, 3) - minor(0, 1, 0, 2) * minor(2, 3, 1, 3) +
             minor(0, 1, 0, 3) * minor(2, 3, 1, 2) + minor(0, 1, 1, 2) * minor(2, 3, 0, 3) -
             minor(0, 1, 1, 3) * minor(2, 3, 0, 2) + minor(0, 1, 2, 3) * minor(2, 3, 0, 1);
    default: {
      const PivotedLu<T> f = pivoted_lu(a);
      T product = f.sign;
      for (Eigen::Index k = 0; k < a.rows(); ++k) product *= f.lu(k, k);
      return product;
    }
  }
}

}  // namespace dyntape::detail
