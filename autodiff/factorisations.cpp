// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/factorisations.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

template class Eigen::PartialPivLU<Eigen::MatrixXd>;

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Eigen::CompleteOrthogonalDecomposition<MatrixXd> orthogonal(const MatrixXd& A, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
  if (threshold > 0) decomposition.setThreshold(threshold);
  return decomposition.compute(A);
}

}  // namespace

VectorXd solve_square(const MatrixXd& A, const VectorXd& b) { return A.partialPivLu().solve(b); }

VectorXd solve_positive(const MatrixXd& A, const VectorXd& b) { return A.llt().solve(b); }
MatrixXd solve_positive(const MatrixXd& A, const MatrixXd& B) { return A.llt().solve(B); }
bool is_positive_definite(const MatrixXd& A) { return A.size() == 0 || A.llt().info() == Eigen::Success; }

VectorXd least_norm_solution(const MatrixXd& A, const VectorXd& b, double threshold) {
  return orthogonal(A, threshold).solve(b);
}
MatrixXd pseudo_inverse(const MatrixXd& A, double threshold) {
  return orthogonal(A, threshold).pseudoInverse();
}

SymmetricEigen symmetric_eigen(const MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> own(A);
  return {own.eigenvalues(), own.eigenvectors()};
}
double least_eigenvalue(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

}  // namespace dyntape
