// SPDX-License-Identifier: BSD-3-Clause
//
// Forward dynamics of joints that follow others: docs/math.md (J.12), (J.16).
#pragma once

#include <dyntape/dynamics/algorithms/detail/checks.hxx>

namespace dyntape::dynamics::detail {

// result = G^T full.
template <class T>
void gather_into(const std::vector<FollowedEntry>& entries, const VectorRef<T>& full, VectorX<T>& result) {
  result.setZero();
  for (size_t k = 0; k < entries.size(); ++k) {
    result[entries[k].index] += scaled<T>(full[k], entries[k].factor);
  }
}

// result = G^T full G.
template <class T>
void gather_into(const std::vector<FollowedEntry>& entries, const MatrixX<T>& full, MatrixX<T>& result) {
  result.setZero();
  for (long c = 0; c < full.cols(); ++c) {
    for (long r = 0; r < full.rows(); ++r) {
      const FollowedEntry &row = entries[r], &column = entries[c];
      result(row.index, column.index) += scaled<T>(full(r, c), row.factor * column.factor);
    }
  }
}

template <class T>
void make_symmetric(MatrixX<T>& M) {
  for (int c = 0; c < M.cols(); ++c) {
    for (int r = 0; r < c; ++r) M(c, r) = M(r, c);
  }
}

// G^T M G = L^T D L.
template <class T>
void factorise(Following<T>& f, const MatrixX<T>& M) {
  MatrixX<T>& L = f.L;
  gather_into(f.entries, M, L);
  make_symmetric(L);
  factor_from_last(L, f.D_inverse, [](int k) { return k - 1; });
}

// x becomes (G^T M G)^-1 x.
template <class T, class Column>
void solve(const Following<T>& f, Column&& x) {
  const int n = static_cast<int>(f.D_inverse.size());
  for (int i = n - 1; i >= 0; --i) {
    for (int j = 0; j < i; ++j) x[j] -= f.L(i, j) * x[i];
  }
  for (int i = 0; i < n; ++i) {
    x[i] *= f.D_inverse[i];
    for (int j = 0; j < i; ++j) x[i] -= f.L(i, j) * x[j];
  }
}

// data.ddq = G (G^T M G)^-1 G^T (tau - h), after factorise.
template <class T>
void accelerate_following(const Model<T>& model, Data<T>& data, const VectorRef<T>& q, const VectorRef<T>& v,
                          const VectorRef<T>& tau, const DynamicsTerms<T>& acting) {
  Following<T>& f = *data.following;
  nonlinear_effects<T>(model, data, q, v, acting);
  data.ddq = tau - data.nle;
  gather_into<T>(f.entries, data.ddq, f.x);
  solve(f, f.x);
  expand<T>(f.entries, f.x, data.ddq);
}

// data.Minv = G (G^T M G)^-1 G^T, after factorise; symmetric to the last bit.
template <class T>
void invert_following(Data<T>& data) {
  Following<T>& f = *data.following;
  f.inverse.setIdentity();
  for (int c = 0; c < f.inverse.cols(); ++c) solve(f, f.inverse.col(c));
  make_symmetric(f.inverse);
  for (long c = 0; c < data.Minv.cols(); ++c) {
    for (long r = 0; r < data.Minv.rows(); ++r) {
      const FollowedEntry &row = f.entries[r], &column = f.entries[c];
      data.Minv(r, c) = scaled<T>(f.inverse(row.index, column.index), row.factor * column.factor);
    }
  }
}

}  // namespace dyntape::dynamics::detail
