// SPDX-License-Identifier: BSD-3-Clause
//
// A = L D L^T of a symmetric positive definite 6 x 6 matrix, without a branch and without a root.
#pragma once

#include <dyntape/dynamics/algebra/scalar.h>

namespace dyntape::dynamics {

template <class T>
struct Ldlt6 {
  Matrix6<T> L = Matrix6<T>::Identity();  // unit lower triangle
  Vector6<T> D_inverse = Vector6<T>::Ones();

  Ldlt6() = default;
  explicit Ldlt6(const Matrix6<T>& A) {
    for (int j = 0; j < 6; ++j) {
      Vector6<T> scaled;  // L_jk D_k
      T d = A(j, j);
      for (int k = 0; k < j; ++k) {
        scaled[k] = L(j, k);
        L(j, k) = scaled[k] * D_inverse[k];
        d -= scaled[k] * L(j, k);
      }
      D_inverse[j] = T(1) / d;
      for (int i = j + 1; i < 6; ++i) {
        L(i, j) = A(i, j);  // times D_j, until row i is reached
        for (int k = 0; k < j; ++k) L(i, j) -= L(i, k) * L(j, k);
      }
    }
  }

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
