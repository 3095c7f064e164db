// SPDX-License-Identifier: BSD-3-Clause
//
// Factorisations of symmetric matrices without branches, for any scalar (guide: linear_algebra.h).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>

#include <dyntape/autodiff/eigen_layout.h>
#include <dyntape/autodiff/error.h>

namespace dyntape {

namespace detail {
template <class A>
void check_square(const A& a, const char* what) {
  if (a.rows() != a.cols()) {
    throw ArgumentError(std::string(what) + ": the matrix is " + std::to_string(a.rows()) + " x " +
                        std::to_string(a.cols()) + ", expected a square one");
  }
}
template <class A>
void check_tall(const A& a, const char* what) {
  if (a.rows() < a.cols()) {
    throw ArgumentError(std::string(what) + ": the matrix is " + std::to_string(a.rows()) + " x " +
                        std::to_string(a.cols()) + ", expected at least as many rows as columns");
  }
}
template <class A, class B>
void check_rows(const A& a, const B& b, const char* what) {
  if (a.rows() != b.rows()) {
    throw ArgumentError(std::string(what) + ": the right-hand side has " + std::to_string(b.rows()) +
                        " rows, the matrix " + std::to_string(a.rows()));
  }
}
}  // namespace detail

// L_jj = sqrt(M_jj - sum_k L_jk^2),  L_ij = (M_ij - sum_k L_ik L_jk) / L_jj
template <class Derived>
typename Derived::PlainObject llt(const Eigen::MatrixBase<Derived>& m) {
  using T = typename Derived::Scalar;
  using std::sqrt;
  detail::check_square(m, "llt");
  typename Derived::PlainObject l = Derived::PlainObject::Zero(m.rows(), m.cols());
  for (Eigen::Index j = 0; j < m.cols(); ++j) {
    for (Eigen::Index i = j; i < m.rows(); ++i) {
      T sum = m(i, j);
      for (Eigen::Index k = 0; k < j; ++k) sum -= l(i, k) * l(j, k);
      l(i, j) = i == j ? T(sqrt(sum)) : T(sum / l(j, j));
    }
  }
  return l;
}

template <class Matrix>
struct Ldlt {
  Matrix l;                                                                // (n x n), unit lower triangular
  Eigen::Matrix<typename Matrix::Scalar, Matrix::RowsAtCompileTime, 1> d;  // (n)
};

// d_j = M_jj - sum_k L_jk^2 d_k,  L_ij = (M_ij - sum_k L_ik L_jk d_k) / d_j
template <class Derived>
Ldlt<typename Derived::PlainObject> ldlt(const Eigen::MatrixBase<Derived>& m) {
  using Plain = typename Derived::PlainObject;
  using T = typename Derived::Scalar;
  detail::check_square(m, "ldlt");
  Ldlt<Plain> f{Plain::Identity(m.rows(), m.cols()), {}};
  f.d.resize(m.rows());
  Plain scaled = Plain::Zero(m.rows(), m.cols());  // L_ij d_j
  for (Eigen::Index j = 0; j < m.cols(); ++j) {
    for (Eigen::Index i = j; i < m.rows(); ++i) {
      T sum = m(i, j);
      for (Eigen::Index k = 0; k < j; ++k) sum -= scaled(i, k) * f.l(j, k);
      if (i == j) {
        f.d[j] = sum;
      } else {
        scaled(i, j) = sum;
        f.l(i, j) = sum / f.d[j];
      }
    }
  }
  return f;
}

// Both solves use forward substitution, scaling, backward substitution.
template <class L, class B>
typename B::PlainObject llt_solve(const Eigen::MatrixBase<L>& l, const Eigen::MatrixBase<B>& b) {
  detail::check_rows(l, b, "llt_solve");
  typename B::PlainObject x = b;
  const Eigen::Index n = l.rows();
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index k = 0; k < i; ++k) x(i, c) -= l(i, k) * x(k, c);
      x(i, c) /= l(i, i);
    }
    for (Eigen::Index i = n; i-- > 0;) {
      for (Eigen::Index k = i + 1; k < n; ++k) x(i, c) -= l(k, i) * x(k, c);
      x(i, c) /= l(i, i);
    }
  }
  return x;
}

template <class Matrix, class B>
typename B::PlainObject ldlt_solve(const Ldlt<Matrix>& f, const Eigen::MatrixBase<B>& b) {
  detail::check_rows(f.l, b, "ldlt_solve");
  typename B::PlainObject x = b;
  const Eigen::Index n = f.l.rows();
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index k = 0; k < i; ++k) x(i, c) -= f.l(i, k) * x(k, c);
    }
    for (Eigen::Index i = n; i-- > 0;) {
      x(i, c) /= f.d[i];
      for (Eigen::Index k = i + 1; k < n; ++k) x(i, c) -= f.l(k, i) * x(k, c);
    }
  }
  return x;
}

}  // namespace dyntape
