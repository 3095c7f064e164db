// SPDX-License-Identifier: BSD-3-Clause
//
// A = L D L^T of a symmetric positive definite matrix, without a branch and without a root.
#pragma once

#include <dyntape/dynamics/algebra/scalar.h>

namespace dyntape::dynamics {

// The lower triangle of A becomes L, but for the ones of its diagonal; the rest is left alone.
template <class Matrix, class Vector>
DYNTAPE_INLINE void factor_ldlt(Matrix& A, Vector& D_inverse) {
  using T = typename Matrix::Scalar;
  const auto n = A.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    T d = A(j, j);
    for (Eigen::Index k = 0; k < j; ++k) {
      const T scaled = A(j, k);  // L_jk D_k
      A(j, k) = scaled * D_inverse[k];
      d -= scaled * A(j, k);
    }
    D_inverse[j] = T(1) / d;
    for (Eigen::Index i = j + 1; i < n; ++i) {  // times D_j, until row i is reached
      for (Eigen::Index k = 0; k < j; ++k) A(i, j) -= A(i, k) * A(j, k);
    }
  }
}

template <class T>
struct Ldlt6 {
  Matrix6<T> L = Matrix6<T>::Identity();  // below the diagonal
  Vector6<T> D_inverse = Vector6<T>::Ones();

  Ldlt6() = default;
  explicit Ldlt6(const Matrix6<T>& A) : L(A) { factor_ldlt(L, D_inverse); }

  Vector6<T> solve(Vector6<T> b) const {
    for (int i = 1; i < 6; ++i) {
      for (int k = 0; k < i; ++k) b[i] -= L(i, k) * b[k];
    }
    b = b.cwiseProduct(D_inverse);
    for (int i = 4; i >= 0; --i) {
      for (int k = i + 1; k < 6; ++k) b[i] -= L(k, i) * b[k];
    }
    return b;
  }
};

}  // namespace dyntape::dynamics
