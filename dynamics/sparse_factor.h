// SPDX-License-Identifier: BSD-3-Clause
//
// M = L^T D L of an inertia matrix, in the order of the tree: nothing is filled in.
//
//   SparseFactor<double> factor(data.tree, model.parent);       // once
//   factor.compute(crba(model, data, q));
//   VectorX<double> a = factor.solve(tau);                      // M a = tau
//
// L (nv x nv) is unit lower triangular with entries where M has them: (i, j) for j on the path from i to its root.
// It is found from the last dof to the first (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, 6.5): the
// branches of a tree do not see each other, where a factorisation from the first dof would join them at the base.
// O(nv d^2) for paths of d dofs; no branch on a value, no root.  M has to be positive definite.
#pragma once

#include <dyntape/dynamics/data.h>

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
    for (int k = nv - 1; k >= 0; --k) {
      D_inverse_[k] = T(1) / L_(k, k);
      for (int i = above_[k]; i >= 0; i = above_[i]) {
        const T l = L_(k, i) * D_inverse_[k];
        for (int j = i; j >= 0; j = above_[j]) L_(i, j) -= l * L_(k, j);
        L_(k, i) = l;
      }
      L_(k, k) = T(1);
    }
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

  const MatrixX<T>& L() const { return L_; }                  // (nv x nv) unit lower triangle
  const VectorX<T>& D_inverse() const { return D_inverse_; }  // (nv)

 private:
  std::vector<int> above_;  // (nv) the dof before k on the way to the root, -1: none
  MatrixX<T> L_;
  VectorX<T> D_inverse_;
};

}  // namespace dyntape::dynamics
