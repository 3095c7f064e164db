// SPDX-License-Identifier: BSD-3-Clause
//
// Factorisations without branches, for any scalar: on a recording they leave no guard, where Eigen's LLT and
// LDLT compare pivots and so tie the recording to one branch.
//
//   MatrixXad L = llt(M);               // M = L L^T, (n x n) symmetric; the lower triangle is read
//   VectorXad x = llt_solve(L, b);      // M x = b, (n) or (n x k)
//   auto f = ldlt(M);                   // M = L D L^T, L unit lower triangular; no square roots
//   VectorXad y = ldlt_solve(f, b);
//   VectorXad u = normalized(v);        // v / |v|; the zero vector stays zero, with slope zero
//
// Without a branch there is no refusal either: where M is not positive definite, llt gives NaN (the square
// root of a negative pivot) and ldlt a negative entry of D or a division by zero.  Pivots are taken in order;
// for the mass matrices and normal equations of robotics that is stable (Golub and Van Loan, 4.2).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>

#include <dyntape/autodiff/eigen_layout.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/op.h>

namespace dyntape {

namespace detail {
template <class A>
void check_square(const A& a, const char* what) {
  if (a.rows() != a.cols()) {
    throw ArgumentError(std::string(what) + ": the matrix is " + std::to_string(a.rows()) + " x " +
                        std::to_string(a.cols()) + ", expected a square one");
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

// Both solves: forward substitution, scaling, backward substitution.
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

// In units in which squares neither overflow nor vanish; these are powers of two, and change no digit.
template <class Derived>
typename Derived::PlainObject normalized(const Eigen::MatrixBase<Derived>& v) {
  using T = typename Derived::Scalar;
  using ops::select;
  using std::sqrt;
  const auto squared = [](const auto& w) {
    T sum = T(0);
    for (Eigen::Index i = 0; i < w.size(); ++i) sum += w[i] * w[i];
    return sum;
  };
  const T rough = squared(v);
  const T unit = select(rough > T(0x1p900), T(0x1p-600), T(select(rough < T(0x1p-900), T(0x1p600), T(1))));
  const typename Derived::PlainObject w = v * unit;
  const T length2 = squared(w);
  const T inverse = select(length2 > T(0), T(T(1) / sqrt(length2)), T(0));
  return w * inverse;
}

}  // namespace dyntape
