// SPDX-License-Identifier: BSD-3-Clause
//
// Linear algebra of matrices of doubles whose size is known at run time, compiled once: a factorisation of Eigen's takes a
// compiler 2 to 7 seconds in each unit that uses it.  The results are Eigen's, bit for bit.
//
//   const VectorXd x = solve_square(A, b);              // A (n, n), b (n)
//   const VectorXd p = least_norm_solution(J, e, 1e-9); // J (m, n) of any rank, e (m)
//
// Shapes that do not fit together are an assertion of Eigen's.  A singular A gives numbers that are not finite.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <memory>

// Where a factorisation is kept: its compute() is the library's.
extern template class Eigen::PartialPivLU<Eigen::MatrixXd>;

namespace dyntape {

// A^-1 b of a square A, by LU with partial pivoting.
Eigen::VectorXd solve_square(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

// A^-1 b or A^-1 B of a symmetric positive definite A, whose lower triangle is read, by Cholesky.
Eigen::VectorXd solve_positive(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXd solve_positive(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
bool is_positive_definite(const Eigen::MatrixXd& A);  // true without entries

// The x of least |x| among those of least |A x - b|, and A^+, by a complete orthogonal decomposition.  Pivots below `threshold`
// times the largest count as zero; 0: rounding times the size.
Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold = 0);
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A, double threshold = 0);
// The same for several b: factorises A once.
class LeastNormSolver {
 public:
  explicit LeastNormSolver(const Eigen::MatrixXd& A, double threshold = 0);
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

 private:
  std::shared_ptr<const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>> factors_;
};

// An orthogonal matrix whose first `rank` columns span the range of A, by QR with column pivoting; the other columns are orthogonal
// to the range.  Pivots below `threshold` times the largest count as zero.
struct OrthonormalBasis {
  Eigen::MatrixXd columns;
  Eigen::Index rank;
  Eigen::MatrixXd range() const { return columns.leftCols(rank); }
  Eigen::MatrixXd complement() const { return columns.rightCols(columns.cols() - rank); }
};
OrthonormalBasis orthonormal_basis(const Eigen::MatrixXd& A, double threshold);

// R (n, n) of the QR factorisation of A (m, n), m >= n.
Eigen::MatrixXd triangular_factor(const Eigen::MatrixXd& A);

// Singular values in descending order and, if they are asked for, the right singular vectors as columns.
struct SingularValues {
  Eigen::VectorXd values;
  Eigen::MatrixXd right;  // (n, n), or empty
};
SingularValues singular_values(const Eigen::MatrixXd& A, bool right = false);

// Of a symmetric A, whose lower triangle is read: eigenvalues in ascending order, and eigenvectors of unit length as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);
double least_eigenvalue(const Eigen::MatrixXd& A);

// Of any square A: its eigenvalues, and exp(A).
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A);
Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& A);

}  // namespace dyntape
