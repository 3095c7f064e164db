// SPDX-License-Identifier: BSD-3-Clause
//
// QR by Householder's reflections (Golub and Van Loan, 5.2), for any scalar and without branches.
//
//   A (m x n, m >= n) = H_0 H_1 ... R,   H_k = I - beta_k v_k v_k^T,   v_k = (0 ... 0, a_kk + s |a|, a_k+1,k, ...)
//
// with s the sign of a_kk (1 at 0) and |a| the length of column k from the diagonal on; then R_kk = -s |a| and
// beta_k = 1 / (|a|^2 + |a_kk| |a|).  The last column of a square matrix needs no reflection.  A column that depends
// on previous columns has R_kk = 0 and an infinite beta_k; results that use it are not finite.
#pragma once

#include <dyntape/autodiff/record/detail/pivoted_lu.h>

namespace dyntape::detail {

template <class T>
struct Householder {
  DynamicMatrix<T> qr;                          // R on the diagonal and above, v_k below it
  Eigen::Matrix<T, Eigen::Dynamic, 1> v, beta;  // v_k at k, and beta_k; of the columns that are reflected
};

// Replaces x by H_k x, from row k on.
template <class T, class X>
void reflect(const Householder<T>& f, Eigen::Index k, X&& x) {
  T along = f.v[k] * x(k);
  for (Eigen::Index i = k + 1; i < f.qr.rows(); ++i) along += f.qr(i, k) * x(i);
  along *= f.beta[k];
  x(k) -= along * f.v[k];
  for (Eigen::Index i = k + 1; i < f.qr.rows(); ++i) x(i) -= along * f.qr(i, k);
}

template <class T>
Householder<T> householder(const DynamicMatrix<T>& a) {
  using ops::select;
  using std::abs;
  using std::sqrt;
  const Eigen::Index m = a.rows(), n = a.cols(), reflected = m > n ? n : m - 1;
  Householder<T> f{a, {}, {}};
  f.v.resize(reflected);
  f.beta.resize(reflected);
  for (Eigen::Index k = 0; k < reflected; ++k) {
    T squares(0);
    for (Eigen::Index i = k; i < m; ++i) squares += f.qr(i, k) * f.qr(i, k);
    const T head = f.qr(k, k), length = sqrt(squares),
            signed_length = select(head < T(0), T(-length), length);
    f.v[k] = head + signed_length;
    f.beta[k] = T(1) / (squares + abs(head) * length);
    f.qr(k, k) = -signed_length;
    for (Eigen::Index j = k + 1; j < n; ++j) reflect(f, k, f.qr.col(j));
  }
  return f;
}

// Solve R y = b and R^T y = b; y replaces the first n rows of b.
template <class T>
void solve_upper(const Householder<T>& f, DynamicMatrix<T>& x) {
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    for (Eigen::Index k = f.qr.cols(); k-- > 0;) {
      for (Eigen::Index j = k + 1; j < f.qr.cols(); ++j) x(k, c) -= f.qr(k, j) * x(j, c);
      x(k, c) /= f.qr(k, k);
    }
  }
}
template <class T>
void solve_upper_transposed(const Householder<T>& f, DynamicMatrix<T>& x) {
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    for (Eigen::Index k = 0; k < f.qr.cols(); ++k) {
      for (Eigen::Index j = 0; j < k; ++j) x(k, c) -= f.qr(j, k) * x(j, c);
      x(k, c) /= f.qr(k, k);
    }
  }
}

// The x of least |A x - b|: R x = the first n rows of Q^T b.
template <class T>
DynamicMatrix<T> least_squares_of(const Householder<T>& f, DynamicMatrix<T> b) {
  for (Eigen::Index c = 0; c < b.cols(); ++c) {
    for (Eigen::Index k = 0; k < f.v.size(); ++k) reflect(f, k, b.col(c));
  }
  DynamicMatrix<T> x = b.topRows(f.qr.cols());
  solve_upper(f, x);
  return x;
}

// Solves A^T A x = b by R^T R, without forming the product.
template <class T>
DynamicMatrix<T> normal_equations_of(const Householder<T>& f, DynamicMatrix<T> b) {
  solve_upper_transposed(f, b);
  solve_upper(f, b);
  return b;
}

}  // namespace dyntape::detail
