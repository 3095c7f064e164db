// SPDX-License-Identifier: BSD-3-Clause
//
// The functions of linear_algebra.h on recorded matrices, as calls with given derivatives (callee.h).  Defined in
// autodiff/matrices/.
//
// Values: the statements of pivoted_lu.h and householder.h, and Jacobi's loop.  Derivatives follow from the
// equations that the results satisfy (Giles, Collected matrix derivative results, 2008), not from the elimination.
// They call the same functions, so that derivatives of any order exist.  X' is the adjoint of X:
//
//   A X = B                   dX = A^-1 (dB - dA X);           B' = A^-T X', A' = -B' X^T
//   X = A^-1                  dX = -X dA X;                    A' = -X^T X' X^T
//   d = det A                 dd = d tr(A^-1 dA);              A' = d' d A^-T
//   min |A X - B|             dX = A^+ (dB - dA X) + G dA^T R, G = (A^T A)^-1, R = B - A X;
//                             L = G X', B' = A L, A' = R L^T - B' X^T
//   A^T A Y = V               dY = G (dV - (dA^T A + A^T dA) Y);   V' = G Y', A' = -A (Y V'^T + V' Y^T)
//   A V = V diag(l), A = A^T  dl_i = v_i^T dA v_i, dv_i = sum_j v_j (v_j^T dA v_i) / (l_i - l_j)
//   A v_i = s_i u_i           ds_i = u_i^T dA v_i;             A' = sum_i s_i' u_i v_i^T
//
// Calls dissolve, so that a value and its derivatives share a factorisation.  Jacobi's loop remains a call.
#pragma once

#include <dyntape/autodiff/record/detail/eigen_traits.h>

namespace dyntape::detail {

MatrixXad solution(const MatrixXad& A, const MatrixXad& B);  // (n x n), (n x k) -> (n x k)
MatrixXad inverse_of(const MatrixXad& A);                    // (n x n)
AD determinant_by_pivots(const MatrixXad& A);                // (n x n)

// Of (m x n) with m >= n and (m x k): the X (n x k) of least |A X - B|.
MatrixXad least_squares_solution(const MatrixXad& A, const MatrixXad& B);

template <class T>
struct SymmetricEigen {
  Eigen::Matrix<T, Eigen::Dynamic, 1> values;                // (n), ascending
  Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic> vectors;  // (n x n), a column each
};

// Reads the lower triangle.
SymmetricEigen<double> symmetric_eigen(const Eigen::MatrixXd& A);
SymmetricEigen<AD> symmetric_eigen(const MatrixXad& A);

// (m x n) -> (min(m, n)), descending
Eigen::VectorXd singular_values_of(const Eigen::MatrixXd& A);
VectorXad singular_values_of(const MatrixXad& A);

}  // namespace dyntape::detail
