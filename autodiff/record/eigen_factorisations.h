// SPDX-License-Identifier: BSD-3-Clause
//
// Eigen's factorisations of recorded matrices, by the functions of linear_algebra.h: without guards, with the same
// derivatives and poles.  eigen.h includes this header, so that all code with AD and Eigen uses it.
//
//   PartialPivLU               solve, inverse, determinant of any size; Eigen calls it for A.determinant(), and for
//                              A.inverse() of five rows or more, or of dynamic size
//   LLT                        solve, matrixL, matrixU, info
//   LDLT                       solve, matrixL, matrixU, vectorD, info; pivots in order (Eigen permutes)
//   HouseholderQR              solve (least squares), householderQ (as a matrix, m x m), matrixQR
//   SelfAdjointEigenSolver     eigenvalues, eigenvectors, operatorSqrt, operatorInverseSqrt, info
//   JacobiSVD, BDCSVD          singularValues; ArgumentError if U or V is requested
//
// solve() returns a matrix, not an expression.  There is no permutationP(): the permutation of the LU differs from
// point to point.  info() compares values and leaves a guard; the other members leave none.
#pragma once

#include <dyntape/autodiff/record/detail/cholesky.h>
#include <dyntape/autodiff/record/detail/eigen_traits.h>
#include <dyntape/autodiff/record/detail/householder.h>
#include <dyntape/autodiff/record/detail/pivoted_lu.h>
#include <dyntape/autodiff/record/detail/recorded_matrices.h>

namespace Eigen {

#define DYNTAPE_OF_AD int Rows, int Cols, int Options, int MaxRows, int MaxCols
#define DYNTAPE_MATRIX_OF_AD Matrix<dyntape::AD, Rows, Cols, Options, MaxRows, MaxCols>
// What all of them have: construction from a matrix, and its sizes.
#define DYNTAPE_FACTORISATION(Name)                            \
 public:                                                       \
  using MatrixType = DYNTAPE_MATRIX_OF_AD;                     \
  using Scalar = dyntape::AD;                                  \
  using RealScalar = dyntape::AD;                              \
  enum { RowsAtCompileTime = Rows, ColsAtCompileTime = Cols }; \
  Name() = default;                                            \
  template <class Derived>                                     \
  explicit Name(const EigenBase<Derived>& m) {                 \
    compute(m);                                                \
  }                                                            \
  Index rows() const { return m_.rows(); }                     \
  Index cols() const { return m_.cols(); }                     \
                                                               \
 private:                                                      \
  MatrixType m_;                                               \
                                                               \
 public:

template <DYNTAPE_OF_AD>
class PartialPivLU<DYNTAPE_MATRIX_OF_AD> {
  DYNTAPE_FACTORISATION(PartialPivLU)
  template <class Derived>
  PartialPivLU& compute(const EigenBase<Derived>& m) {
    m_ = m.derived();
    dyntape::detail::check_square(m_, "PartialPivLU");
    return *this;
  }
  template <class B>
  Matrix<Scalar, Cols, B::ColsAtCompileTime> solve(const MatrixBase<B>& b) const {
    dyntape::detail::check_rows(m_, b, "PartialPivLU::solve");
    return dyntape::detail::solution(m_, b.template cast<Scalar>());
  }
  // const, so that the result is copied, not moved: Eigen takes the address of the target of A.inverse() before the
  // assignment, and a move changes the address.
  const MatrixType inverse() const { return dyntape::detail::inverse_of(m_); }
  Scalar determinant() const {
    return m_.rows() > 4 ? dyntape::detail::determinant_by_pivots(m_)
                         : dyntape::detail::determinant_of<Scalar>(m_);
  }
  const MatrixType& reconstructedMatrix() const { return m_; }
};

template <DYNTAPE_OF_AD, int UpLo>
class LLT<DYNTAPE_MATRIX_OF_AD, UpLo> {
  DYNTAPE_FACTORISATION(LLT)
  template <class Derived>
  LLT& compute(const EigenBase<Derived>& m) {
    m_ = m.derived();
    m_ = UpLo == Lower ? dyntape::llt(m_) : dyntape::llt(MatrixType(m_.transpose()));
    return *this;
  }
  template <class B>
  Matrix<Scalar, Cols, B::ColsAtCompileTime> solve(const MatrixBase<B>& b) const {
    const Matrix<Scalar, Cols, B::ColsAtCompileTime> right = b.template cast<Scalar>();
    return dyntape::llt_solve(m_, right);
  }
  auto matrixL() const { return m_.template triangularView<Lower>(); }
  auto matrixU() const { return m_.transpose().template triangularView<Upper>(); }
  MatrixType reconstructedMatrix() const { return m_ * m_.transpose(); }
  ComputationInfo info() const {
    for (Index i = 0; i < rows(); ++i) {
      if (!bool(m_(i, i) > 0.0)) return NumericalIssue;
    }
    return Success;
  }
};

template <DYNTAPE_OF_AD, int UpLo>
class LDLT<DYNTAPE_MATRIX_OF_AD, UpLo> {
  DYNTAPE_FACTORISATION(LDLT)
  template <class Derived>
  LDLT& compute(const EigenBase<Derived>& m) {
    m_ = m.derived();
    const auto f = UpLo == Lower ? dyntape::ldlt(m_) : dyntape::ldlt(MatrixType(m_.transpose()));
    m_ = f.l;
    d_ = f.d;
    return *this;
  }
  template <class B>
  Matrix<Scalar, Cols, B::ColsAtCompileTime> solve(const MatrixBase<B>& b) const {
    const Matrix<Scalar, Cols, B::ColsAtCompileTime> right = b.template cast<Scalar>();
    return dyntape::ldlt_solve(dyntape::Ldlt<MatrixType>{m_, d_}, right);
  }
  auto matrixL() const { return m_.template triangularView<UnitLower>(); }
  auto matrixU() const { return m_.transpose().template triangularView<UnitUpper>(); }
  const Matrix<Scalar, Rows, 1>& vectorD() const { return d_; }
  MatrixType reconstructedMatrix() const { return m_ * d_.asDiagonal() * m_.transpose(); }
  ComputationInfo info() const {
    for (Index i = 0; i < rows(); ++i) {
      if (!bool(d_[i] != 0.0)) return NumericalIssue;
    }
    return Success;
  }

 private:
  Matrix<Scalar, Rows, 1> d_;
};

template <DYNTAPE_OF_AD>
class HouseholderQR<DYNTAPE_MATRIX_OF_AD> {
  DYNTAPE_FACTORISATION(HouseholderQR)
  template <class Derived>
  HouseholderQR& compute(const EigenBase<Derived>& m) {
    m_ = m.derived();
    f_ = dyntape::detail::householder<Scalar>(m_);
    return *this;
  }
  template <class B>
  Matrix<Scalar, Cols, B::ColsAtCompileTime> solve(const MatrixBase<B>& b) const {
    dyntape::detail::check_tall(m_, "HouseholderQR::solve");
    dyntape::detail::check_rows(m_, b, "HouseholderQR::solve");
    return dyntape::detail::least_squares_solution(m_, b.template cast<Scalar>());
  }
  Matrix<Scalar, Rows, Rows> householderQ() const {
    dyntape::MatrixXad Q = dyntape::MatrixXad::Identity(rows(), rows());
    for (Index c = 0; c < rows(); ++c) {
      for (Index k = f_.v.size(); k-- > 0;) dyntape::detail::reflect(f_, k, Q.col(c));
    }
    return Q;
  }
  MatrixType matrixQR() const { return f_.qr; }  // R is its upper triangle

 private:
  dyntape::detail::Householder<Scalar> f_;
};

template <class MatrixType>
class SelfAdjointEigenSolver;

template <DYNTAPE_OF_AD>
class SelfAdjointEigenSolver<DYNTAPE_MATRIX_OF_AD> {
  DYNTAPE_FACTORISATION(SelfAdjointEigenSolver)
  using VectorType = Matrix<Scalar, Rows, 1>;
  template <class Derived>
  SelfAdjointEigenSolver(const EigenBase<Derived>& m, int options) {
    compute(m, options);
  }
  template <class Derived>
  SelfAdjointEigenSolver& compute(const EigenBase<Derived>& m, int = ComputeEigenvectors) {
    m_ = m.derived();
    dyntape::detail::check_square(m_, "SelfAdjointEigenSolver");
    const auto e = dyntape::detail::symmetric_eigen(dyntape::MatrixXad(m_));
    l_ = e.values;
    m_ = e.vectors;
    return *this;
  }
  template <class Derived>
  SelfAdjointEigenSolver& computeDirect(const EigenBase<Derived>& m, int options = ComputeEigenvectors) {
    return compute(m, options);
  }
  const VectorType& eigenvalues() const { return l_; }
  const MatrixType& eigenvectors() const { return m_; }
  MatrixType operatorSqrt() const { return m_ * l_.cwiseSqrt().asDiagonal() * m_.transpose(); }
  MatrixType operatorInverseSqrt() const {
    return m_ * l_.cwiseSqrt().cwiseInverse().asDiagonal() * m_.transpose();
  }
  ComputationInfo info() const { return rows() == 0 || l_[0] == l_[0] ? Success : NoConvergence; }

 private:
  VectorType l_;
};

#define DYNTAPE_SINGULAR_VALUES(Name)                                                                 \
  DYNTAPE_FACTORISATION(Name)                                                                         \
  using SingularValuesType = Matrix<Scalar, Dynamic, 1>;                                              \
  template <class Derived>                                                                            \
  Name(const EigenBase<Derived>& m, unsigned options) {                                               \
    compute(m, options);                                                                              \
  }                                                                                                   \
  template <class Derived>                                                                            \
  Name& compute(const EigenBase<Derived>& m, unsigned options = 0) {                                  \
    if (options & (ComputeFullU | ComputeThinU | ComputeFullV | ComputeThinV)) {                      \
      throw dyntape::ArgumentError(#Name " of a recorded matrix gives singular values, not U and V"); \
    }                                                                                                 \
    m_ = m.derived();                                                                                 \
    s_ = dyntape::detail::singular_values_of(dyntape::MatrixXad(m_));                                 \
    return *this;                                                                                     \
  }                                                                                                   \
  const SingularValuesType& singularValues() const { return s_; }                                     \
                                                                                                      \
 private:                                                                                             \
  SingularValuesType s_;

template <DYNTAPE_OF_AD, int Preconditioner>
class JacobiSVD<DYNTAPE_MATRIX_OF_AD, Preconditioner> {
  DYNTAPE_SINGULAR_VALUES(JacobiSVD)
};

template <DYNTAPE_OF_AD>
class BDCSVD<DYNTAPE_MATRIX_OF_AD> {
  DYNTAPE_SINGULAR_VALUES(BDCSVD)
};

#undef DYNTAPE_SINGULAR_VALUES
#undef DYNTAPE_FACTORISATION
#undef DYNTAPE_MATRIX_OF_AD
#undef DYNTAPE_OF_AD

}  // namespace Eigen
