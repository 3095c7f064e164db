// SPDX-License-Identifier: BSD-3-Clause
//
// The factorisation M = L^T D L of an inertia matrix in the order of the tree, without fill-in.
//
//   SparseFactor<double> factor(data.tree, model.parent);       // once
//   factor.compute(crba(model, data, q));
//   VectorX<double> a = factor.solve(tau);                      // M a = tau
//   MatrixX<double> W = factor.inverse_of_L();                  // M^-1 = W D^-1 W^T
//
// L (nv x nv) is unit lower triangular with entries where M has them: (i, j) for j on the path from i to its root.
// It is found from the last dof to the first: the branches of a tree do not see each other, where a factorisation from
// the first dof would join them at the base.
// O(nv d^2) for paths of d dofs; no branch on a value, no root.  M has to be positive definite; the result
// loses as many digits as inertia_condition.h says.
#pragma once

#include <dyntape/dynamics/algorithms/data.h>

#include <algorithm>
#include <vector>

namespace dyntape::dynamics {

template <class T>
class SparseFactor {
 public:
  // `parent`: Model::parent.
  SparseFactor(const Tree& tree, const std::vector<int>& parent) {
    const int nv = static_cast<int>(tree.dofs.size());
    for (int k = 0; k < nv; ++k) {
      const int i = tree.dofs[k].joint, p = parent[i];
      above_.push_back(k > tree.first[i] ? k - 1 : p < 0 ? -1 : tree.first[p] + tree.count[p] - 1);
    }
    L_ = MatrixX<T>::Zero(nv, nv);
    D_inverse_ = VectorX<T>::Zero(nv);
  }

  void compute(const MatrixX<T>& M) {
    const int nv = static_cast<int>(above_.size());
    for (int k = 0; k < nv; ++k) {
      for (int i = k; i >= 0; i = above_[i]) L_(k, i) = M(k, i);
    }
    factor_from_last(L_, D_inverse_, [&](int k) { return above_[k]; });
    L_.diagonal().setOnes();
  }

  // M x = b.
  VectorX<T> solve(VectorX<T> b) const {
    const int nv = static_cast<int>(above_.size());
    for (int k = nv - 1; k >= 0; --k) {
      for (int i = above_[k]; i >= 0; i = above_[i]) b[i] -= L_(k, i) * b[k];
    }
    for (int k = 0; k < nv; ++k) {
      b[k] *= D_inverse_[k];
      for (int i = above_[k]; i >= 0; i = above_[i]) b[k] -= L_(k, i) * b[i];
    }
    return b;
  }

  // Unit lower triangular, with entries where L has them: column j of W solves L w = e_j.
  MatrixX<T> inverse_of_L() const {
    const int nv = static_cast<int>(above_.size());
    MatrixX<T> W = MatrixX<T>::Identity(nv, nv);
    for (int k = 0; k < nv; ++k) {
      for (int j = above_[k]; j >= 0; j = above_[j]) {
        T sum = L_(k, j);
        for (int i = above_[k]; i > j; i = above_[i]) sum += L_(k, i) * W(i, j);
        W(k, j) = -sum;
      }
    }
    return W;
  }

  // M^-1, symmetric to the last bit: entry (i, j) sums over the dofs that are on the way from both to the root.
  MatrixX<T> inverse() const {
    const int nv = static_cast<int>(above_.size());
    const MatrixX<T> W = inverse_of_L();
    MatrixX<T> inverse = MatrixX<T>::Zero(nv, nv);
    std::vector<char> is_above(above_.size());
    for (int i = 0; i < nv; ++i) {
      std::fill(is_above.begin(), is_above.end(), 0);
      for (int k = i; k >= 0; k = above_[k]) is_above[k] = 1;
      for (int j = 0; j <= i; ++j) {
        T sum = T(0);
        for (int k = j; k >= 0; k = above_[k]) {
          if (is_above[k]) sum += W(i, k) * T(W(j, k) * D_inverse_[k]);
        }
        inverse(i, j) = inverse(j, i) = sum;
      }
    }
    return inverse;
  }

  const MatrixX<T>& L() const { return L_; }                  // (nv x nv) unit lower triangle
  const VectorX<T>& D_inverse() const { return D_inverse_; }  // (nv)

 private:
  std::vector<int> above_;  // (nv) the dof before k on the way to the root, -1: none
  MatrixX<T> L_;
  VectorX<T> D_inverse_;
};

}  // namespace dyntape::dynamics
