// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/matrices/matrix_callees.h>
#include <dyntape/autodiff/matrices/symmetric_eigen.h>
#include <dyntape/autodiff/record/detail/pivoted_lu.h>

// Singular values as the r = min(m, n) largest eigenvalues of (0 A; A^T 0), whose others are the negative ones and
// |m - n| zeros (Golub and Van Loan, 8.6): to rounding of the largest, zero ones included.  The eigenvector of s_i is
// (u_i, v_i) / sqrt(2).
namespace dyntape::detail {
namespace {

// (0 A; A^T 0)
template <class T>
SymmetricEigen<T> eigen_of_both(const DynamicMatrix<T>& A) {
  const Eigen::Index m = A.rows(), n = A.cols();
  DynamicMatrix<T> both = DynamicMatrix<T>::Zero(m + n, m + n);
  both.bottomLeftCorner(n, m) = A.transpose();  // the lower triangle is read
  return symmetric_eigen(both);
}

template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> largest(const SymmetricEigen<T>& both, Eigen::Index r) {
  return both.values.tail(r).cwiseAbs().reverse();
}

// (A, dA) -> ds
VectorXad singular_tangents(FlatReader in, Eigen::Index m, Eigen::Index n) {
  const auto both = eigen_of_both<AD>(in.next(m, n));
  const MatrixXad dA = in.next(m, n);
  VectorXad ds(std::min(m, n));
  for (Eigen::Index k = 0; k < ds.size(); ++k) {
    const Eigen::Index i = m + n - 1 - k;
    const VectorXad w = both.vectors.col(i), moved = dA * w.tail(n);
    ds[k] = unless_repeated(both.values, i, 2.0 * w.head(m).dot(moved));
  }
  return ds;
}

// (A, s') -> A'
VectorXad singular_adjoints(FlatReader in, Eigen::Index m, Eigen::Index n) {
  const auto both = eigen_of_both<AD>(in.next(m, n));
  const VectorXad adjoints = in.next(std::min(m, n), 1);
  MatrixXad to_A = MatrixXad::Zero(m, n);
  for (Eigen::Index k = 0; k < adjoints.size(); ++k) {
    const Eigen::Index i = m + n - 1 - k;
    const VectorXad w = both.vectors.col(i),
                    v = unless_repeated(both.values, i, 2.0 * adjoints[k]) * w.tail(n);
    to_A += w.head(m) * v.transpose();
  }
  return flat({to_A});
}

}  // namespace

Eigen::VectorXd singular_values_of(const Eigen::MatrixXd& A) {
  return largest(eigen_of_both<double>(A), std::min(A.rows(), A.cols()));
}

VectorXad singular_values_of(const MatrixXad& A) {
  const Eigen::Index m = A.rows(), n = A.cols(), r = std::min(m, n);
  if (r == 0) return VectorXad();
  const MatrixFunction f{sized_name("singular_values", m, n, r),
                         m * n,
                         r,
                         [=](FlatReader in) { return largest(eigen_of_both<AD>(in.next(m, n)), r); },
                         [=](FlatReader in) { return singular_tangents(in, m, n); },
                         [=](FlatReader in) { return singular_adjoints(in, m, n); }};
  return call(callee_of(f), flat({A}));
}

}  // namespace dyntape::detail
