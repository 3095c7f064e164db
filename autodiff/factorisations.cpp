// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/factorisations.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <unsupported/Eigen/MatrixFunctions>

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
  if (A.size() == 0) return VectorXd::Zero(A.cols());
  return orthogonal(A, threshold).solve(b);
}
MatrixXd pseudo_inverse(const MatrixXd& A, double threshold) {
  return orthogonal(A, threshold).pseudoInverse();
}

LeastNormSolver::LeastNormSolver(const MatrixXd& A, double threshold)
    : factors_(std::make_shared<const Eigen::CompleteOrthogonalDecomposition<MatrixXd>>(
          orthogonal(A, threshold))) {}
VectorXd LeastNormSolver::solve(const VectorXd& b) const { return factors_->solve(b); }

OrthonormalBasis orthonormal_basis(const MatrixXd& A, double threshold) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  qr.setThreshold(threshold);
  return {qr.householderQ(), qr.rank()};
}

MatrixXd triangular_factor(const MatrixXd& A) {
  return Eigen::HouseholderQR<MatrixXd>(A).matrixQR().topRows(A.cols()).triangularView<Eigen::Upper>();
}

SingularValues singular_values(const MatrixXd& A, bool right) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, right ? Eigen::ComputeFullV : 0);
  return {svd.singularValues(), right ? svd.matrixV() : MatrixXd()};
}

SymmetricEigen symmetric_eigen(const MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> own(A);
  return {own.eigenvalues(), own.eigenvectors()};
}
double least_eigenvalue(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

Eigen::VectorXcd eigenvalues(const MatrixXd& A) { return A.eigenvalues(); }
MatrixXd matrix_exponential(const MatrixXd& A) { return A.exp(); }

}  // namespace dyntape
