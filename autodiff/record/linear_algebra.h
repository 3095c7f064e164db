// SPDX-License-Identifier: BSD-3-Clause
//
// Linear algebra without branches, for any scalar.  Use these functions in recorded code: they leave no guard, and
// the recording is valid at every point.
//
//   MatrixXad X = solve(A, B);                // A X = B, (n x n), (n x k)
//   MatrixXad X = inverse(A);                 // (n x n)
//   AD d = determinant(A);                    // (n x n)
//   MatrixXad X = least_squares(A, B);        // the X of least |A X - B|, (m x n) with m >= n, (m x k) -> (n x k)
//   MatrixXad L = llt(M);                     // M = L L^T, (n x n) symmetric; the lower triangle is read
//   VectorXad x = llt_solve(L, b);            // M x = b, (n) or (n x k)
//   auto f = ldlt(M);                         // M = L D L^T, L unit lower triangular; no square roots
//   VectorXad y = ldlt_solve(f, b);
//   VectorXad l = eigenvalues_symmetric(M);   // (n), ascending; the lower triangle is read
//   auto e = eigen_symmetric(M);              // e.values (n), e.vectors (n x n): columns, the largest entry positive
//   VectorXad s = singular_values(A);         // (m x n) -> (min(m, n)), descending
//   VectorXad u = normalized(v);              // v / |v|; the zero vector stays zero, with slope zero
//
// Eigen's own calls use the same functions (eigen.h): A.inverse(), A.partialPivLu().solve(b), ...  ArgumentError:
// wrong sizes.
//
// Methods (sections of Golub and Van Loan):
//   LU                   pivoted by selection: every evaluation chooses its row exchanges (detail/pivoted_lu.h, 3.4)
//   determinant          n <= 4: a sum of cofactors; n > 4: LU
//   least_squares        Householder QR (detail/householder.h, 5.2)
//   eigenvalues,         Jacobi rotations, recorded as a loop (autodiff/matrices/symmetric_eigen.h, 8.5 and 8.6);
//   singular values      double and AD only
// On a tape, the derivatives of solve, inverse, determinant (n > 4), least_squares, eigenvalues and singular values
// follow from the equations that the results satisfy, to any order (detail/recorded_matrices.h).  The derivatives of
// llt and ldlt follow from their statements.  Complexity on a tape: n^3 statements; eigenvalues: n^2 statements and
// a loop.
//
// Poles.  Code without branches cannot refuse a point: at these points some or all results or slopes are not finite:
//   solve, inverse       A singular to the last bit: a pivot is 0
//   determinant, n > 4   the same for the slopes; the value is 0.  For n <= 4 value and slopes are right
//   least_squares        a column of A depends on other columns to the last bit
//   llt                  M not positive definite: NaN, the root of a negative pivot
//   ldlt                 a leading block of M is singular: a division by zero.  Pivots are taken in order, which is
//                        stable for definite M (4.2); for other M use solve()
//   eigenvalues,         slopes at repeated eigenvalues (closer than 16 n epsilon |M|): the slopes of these eigenvalues
//   eigenvectors         and of all eigenvectors that turn into each other
//   singular_values      slopes at repeated or zero singular values
// A nearly singular matrix is no pole; it costs digits according to its condition number.
//
// A pole in the branch of a select that is not taken still makes slopes NaN.  Avoid the pole in the argument:
// solve(select(c, A, I), b).  If eigenvalues repeat that the function does not use, pass vjp() and jvp() of a
// function of eigenvectors to dissolved() (function.h); derive() does this.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/graph/op.h>
#include <dyntape/autodiff/record/detail/cholesky.h>
#include <dyntape/autodiff/record/detail/householder.h>
#include <dyntape/autodiff/record/detail/pivoted_lu.h>
#include <dyntape/autodiff/record/detail/recorded_matrices.h>
#include <dyntape/autodiff/record/eigen.h>

namespace dyntape {

namespace detail {

// The scalar of an operation on two matrices, one of which may hold doubles.
template <class A, class B>
using CommonScalar =
    std::conditional_t<std::is_same_v<typename A::Scalar, double>, typename B::Scalar, typename A::Scalar>;

template <class T>
DynamicMatrix<T> solution(const DynamicMatrix<T>& a, DynamicMatrix<T> x) {
  return solve_in_place(pivoted_lu(a), x), x;
}
template <class T>
DynamicMatrix<T> inverse_of(const DynamicMatrix<T>& a) {
  return solution<T>(a, DynamicMatrix<T>::Identity(a.rows(), a.rows()));
}
template <class T>
DynamicMatrix<T> least_squares_solution(const DynamicMatrix<T>& a, const DynamicMatrix<T>& b) {
  return least_squares_of(householder(a), b);
}

}  // namespace detail

template <class A, class B>
auto solve(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  using T = detail::CommonScalar<A, B>;
  detail::check_square(a, "solve");
  detail::check_rows(a, b, "solve");
  const detail::DynamicMatrix<T> left = a.template cast<T>(), right = b.template cast<T>();
  return Eigen::Matrix<T, A::ColsAtCompileTime, B::ColsAtCompileTime>(detail::solution(left, right));
}

template <class A>
typename A::PlainObject inverse(const Eigen::MatrixBase<A>& a) {
  detail::check_square(a, "inverse");
  return detail::inverse_of(detail::DynamicMatrix<typename A::Scalar>(a));
}

template <class A>
typename A::Scalar determinant(const Eigen::MatrixBase<A>& a) {
  using T = typename A::Scalar;
  detail::check_square(a, "determinant");
  if constexpr (std::is_same_v<T, AD>) {
    if (a.rows() > 4) return detail::determinant_by_pivots(a);
  }
  return detail::determinant_of<T>(a);
}

template <class A, class B>
auto least_squares(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  using T = detail::CommonScalar<A, B>;
  detail::check_tall(a, "least_squares");
  detail::check_rows(a, b, "least_squares");
  const detail::DynamicMatrix<T> left = a.template cast<T>(), right = b.template cast<T>();
  return Eigen::Matrix<T, A::ColsAtCompileTime, B::ColsAtCompileTime>(
      detail::least_squares_solution(left, right));
}

template <class A>
detail::SymmetricEigen<typename A::Scalar> eigen_symmetric(const Eigen::MatrixBase<A>& a) {
  using T = typename A::Scalar;
  static_assert(std::is_same_v<T, double> || std::is_same_v<T, AD>, "eigenvalues are of double and AD only");
  detail::check_square(a, "eigen_symmetric");
  return detail::symmetric_eigen(detail::DynamicMatrix<T>(a));
}

template <class A>
Eigen::Matrix<typename A::Scalar, A::ColsAtCompileTime, 1> eigenvalues_symmetric(
    const Eigen::MatrixBase<A>& a) {
  return eigen_symmetric(a).values;
}

template <class A>
Eigen::Matrix<typename A::Scalar, Eigen::Dynamic, 1> singular_values(const Eigen::MatrixBase<A>& a) {
  using T = typename A::Scalar;
  static_assert(std::is_same_v<T, double> || std::is_same_v<T, AD>,
                "singular values are of double and AD only");
  return detail::singular_values_of(detail::DynamicMatrix<T>(a));
}

// Scales v by a power of two first, so that squares neither overflow nor vanish; the scaling changes no digit.
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
