// SPDX-License-Identifier: BSD-3-Clause
//
// Factorisations A = L D L^T and A = L^T D L of symmetric positive definite matrices, without branches and square
// roots.
#pragma once

#include <dyntape/dynamics/algebra/scalar.h>

namespace dyntape::dynamics {

// The lower triangle of A becomes L without its unit diagonal; the rest of A does not change.
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
    for (Eigen::Index i = j + 1; i < n; ++i) {  // times D_j until row i is reached
      for (Eigen::Index k = 0; k < j; ++k) A(i, j) -= A(i, k) * A(j, k);
    }
  }
}

// A = L^T D L, from the last row to the first.  Row k has entries at above(k), above(above(k)), ... down to -1:
// branches of a tree are independent, and there is no fill-in.  Source: R. Featherstone, Rigid Body Dynamics
// Algorithms, 2008, 6.3 and 6.5.
template <class T, class Above>
void factor_from_last(MatrixX<T>& A, VectorX<T>& D_inverse, Above above) {
  for (int k = static_cast<int>(A.rows()) - 1; k >= 0; --k) {
    D_inverse[k] = T(1) / A(k, k);
    for (int i = above(k); i >= 0; i = above(i)) {
      const T l = A(k, i) * D_inverse[k];
      for (int j = i; j >= 0; j = above(j)) A(i, j) -= l * A(k, j);
      A(k, i) = l;
    }
  }
}

template <class T>
struct Ldlt6 {
  Matrix6<T> L = Matrix6<T>::Identity();  // below the diagonal
  Vector6<T> D_inverse = Vector6<T>::Ones();

  Ldlt6() = default;
  DYNTAPE_INLINE explicit Ldlt6(const Matrix6<T>& A) : L(A) { factor_ldlt(L, D_inverse); }

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
