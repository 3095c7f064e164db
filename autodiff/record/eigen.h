// SPDX-License-Identifier: BSD-3-Clause
//
// AD as a scalar of Eigen: products, norms, factorisations, quaternions, and expressions that mix AD and
// double.  x.cast<double>() are the values at the recording point, as value() is; what is computed of them is a
// constant of the recording.
//
// These of Eigen's calls leave no guard, and hold at every point (eigen_factorisations.h has what each gives):
//
//   A.inverse(), A.determinant(), A.partialPivLu(), A.llt(), A.ldlt(), A.householderQr(),
//   Eigen::SelfAdjointEigenSolver<MatrixXad>(A), A.jacobiSvd(), A.bdcSvd()      of square or rectangular A, of any size
//
// Its other factorisations (FullPivLU, ColPivHouseholderQR, EigenSolver, ...) branch, and each branch leaves a guard, also
// one that the result does not depend on.  linear_algebra.h has the same functions by name, for any scalar.
#pragma once

#include <dyntape/autodiff/record/detail/eigen_traits.h>
#include <dyntape/autodiff/record/eigen_factorisations.h>
