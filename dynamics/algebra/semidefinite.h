// SPDX-License-Identifier: BSD-3-Clause
//
// Solves G x = b for a symmetric positive semidefinite G: the least-squares solution of least norm, without branches
// on recorded values and without square roots.
//
//   Semidefinite<double> solver(m);
//   solver.factor(G, false);          // true: G is known to be regular
//   solver.solve(x);                  // x: b before, the solution after
//
// G = L D L^T in the given order.  A pivot that vanishes up to rounding marks a row that depends on earlier rows.
// Its column of L and its entry of D^+ are zero; its row of L^-1 spans, with those of the other dependent rows, the
// null space N of G.  With P the projection along N (docs/math.md (L.9)),
//   G^+ = P L^-T D^+ L^-1 P.
#pragma once

#include <dyntape/dynamics/algebra/ldlt.h>

#include <vector>

namespace dyntape::dynamics {

// Returns false if a condition is a plain bool that does not hold.  A recorded condition, or one of several lanes,
// may hold.
template <class C>
bool may_hold(const C& condition) {
  if constexpr (std::same_as<C, bool>) {
    return condition;
  } else {
    return true;
  }
}

template <class T>
class Semidefinite {
 public:
  explicit Semidefinite(int size)
      : L_inverse_(MatrixX<T>::Identity(size, size)),
        C_(MatrixX<T>::Zero(size, size)),
        D_inverse_(VectorX<T>::Zero(size)),
        dependent_(VectorX<T>::Zero(size)),
        C_inverse_(VectorX<T>::Zero(size)),
        rounding_(VectorX<T>::Zero(size)),
        y_(VectorX<T>::Zero(size)),
        z_(VectorX<T>::Zero(size)) {}

  // Overwrites the lower triangle of G; the upper one is ignored.
  void factor(MatrixX<T>& G, bool regular);
  void solve(Eigen::Ref<VectorX<T>> x);

  // (size) 1 for rows that depend on earlier rows, 0 for others.
  const VectorX<T>& dependent() const { return dependent_; }

 private:
  void invert(const MatrixX<T>& L);
  void factor_null_space();
  void project(Eigen::Ref<VectorX<T>> x);

  MatrixX<T> L_inverse_;  // unit lower triangle
  MatrixX<T> C_;          // N^T N, factored in place
  VectorX<T> D_inverse_, dependent_, C_inverse_, rounding_, y_, z_;
  bool projects_ = false;  // true: some row may be dependent
};

// The remainder of a row is compared with the row itself, with all rows (rows that are zero up to rounding are
// dependent), and with its possible rounding error: subtracting l times another row adds l^2 times the rounding of
// that row's pivot, which is large after small pivots.
template <class T>
void Semidefinite<T>::factor(MatrixX<T>& G, bool regular) {
  const long m = G.rows();
  const T own(std::ldexp(1.0, -kDigits<T> * 3 / 4)), all(std::ldexp(1.0, -kDigits<T>));
  constexpr double kShare = 0x1p-10;  // of the other rows in the rounding of one
  constexpr double kMargin = 16;      // rounding errors add up
  T mean(0);
  for (long j = 0; j < m; ++j) mean += G(j, j);
  mean *= T(1.0 / static_cast<double>(m > 0 ? m : 1));
  projects_ = false;
  for (long j = 0; j < m; ++j) {
    y_[j] = G(j, j);
    if (!regular) rounding_[j] = all * (y_[j] + mean * T(kShare));
  }
  for (long j = 0; j < m; ++j) {
    T* column = G.data() + j * m;
    const T d = column[j];
    if (regular) {
      D_inverse_[j] = T(1) / d;
      dependent_[j] = T(0);
    } else {
      const auto lost = d <= own * y_[j] + all * mean + T(kMargin) * rounding_[j];
      D_inverse_[j] = select(lost, T(0), T(T(1) / select(lost, T(1), d)));
      dependent_[j] = select(lost, T(1), T(0));
      projects_ = projects_ || may_hold(lost);
    }
    for (long i = j + 1; i < m; ++i) {
      const T l = column[i] * D_inverse_[j];
      if (!regular) rounding_[i] += l * l * rounding_[j];
      T* rest = G.data() + i * m;
      for (long r = i; r < m; ++r) rest[r] -= column[r] * l;
      column[i] = l;
    }
  }
  invert(G);
  if (projects_) factor_null_space();
}

// Columns of L^-1 by forward substitution of the columns of 1.
template <class T>
void Semidefinite<T>::invert(const MatrixX<T>& L) {
  const long m = L.rows();
  for (long j = 0; j < m; ++j) {
    T* x = L_inverse_.data() + j * m;
    const T* first = L.data() + j * m;
    for (long i = j + 1; i < m; ++i) x[i] = -first[i];
    for (long k = j + 1; k < m; ++k) {
      const T* column = L.data() + k * m;
      for (long i = k + 1; i < m; ++i) x[i] -= column[i] * x[k];
    }
  }
}

// C = N^T N on dependent rows, 1 on the diagonal of the others.
template <class T>
void Semidefinite<T>::factor_null_space() {
  const long m = L_inverse_.rows();
  for (long j = 0; j < m; ++j) {
    for (long i = j; i < m; ++i) {
      T sum(0);
      for (long k = 0; k <= j; ++k) sum += L_inverse_(i, k) * L_inverse_(j, k);
      C_(i, j) = sum * (dependent_[i] * dependent_[j]);
    }
    C_(j, j) += T(1) - dependent_[j];
  }
  factor_ldlt(C_, C_inverse_);
}

// x -= N (N^T N)^-1 N^T x.
template <class T>
void Semidefinite<T>::project(Eigen::Ref<VectorX<T>> x) {
  const long m = L_inverse_.rows();
  for (long j = 0; j < m; ++j) {
    T sum(0);
    for (long k = 0; k <= j; ++k) sum += L_inverse_(j, k) * x[k];
    z_[j] = sum * dependent_[j];
    for (long k = 0; k < j; ++k) z_[j] -= C_(j, k) * z_[k];
  }
  for (long j = m - 1; j >= 0; --j) {
    z_[j] *= C_inverse_[j];
    for (long k = j + 1; k < m; ++k) z_[j] -= C_(k, j) * z_[k];
  }
  for (long j = 0; j < m; ++j) {
    const T s = z_[j] * dependent_[j];
    for (long k = 0; k <= j; ++k) x[k] -= L_inverse_(j, k) * s;
  }
}

template <class T>
void Semidefinite<T>::solve(Eigen::Ref<VectorX<T>> x) {
  const long m = L_inverse_.rows();
  if (projects_) project(x);
  y_ = x;
  for (long k = 0; k < m; ++k) {
    const T* column = L_inverse_.data() + k * m;
    for (long i = k + 1; i < m; ++i) y_[i] += column[i] * x[k];
  }
  for (long i = 0; i < m; ++i) y_[i] *= D_inverse_[i];
  for (long i = 0; i < m; ++i) {
    const T* column = L_inverse_.data() + i * m;
    T sum = y_[i];
    for (long k = i + 1; k < m; ++k) sum += column[k] * y_[k];
    x[i] = sum;
  }
  if (projects_) project(x);
}

}  // namespace dyntape::dynamics
