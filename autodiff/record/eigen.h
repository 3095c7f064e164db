// SPDX-License-Identifier: BSD-3-Clause
//
// Makes AD a scalar of Eigen: products, norms, factorisations, quaternions, and expressions that mix AD and double.
// x.cast<double>() returns the values at the recording point, like value(); results computed from these are
// constants of the recording.
//
// These calls of Eigen leave no guard and are valid at every point (details: eigen_factorisations.h):
//
//   A.inverse(), A.determinant(), A.partialPivLu(), A.llt(), A.ldlt(), A.householderQr(),
//   Eigen::SelfAdjointEigenSolver<MatrixXad>(A), A.jacobiSvd(), A.bdcSvd()      of square or rectangular A, of any size
//
// Eigen's other factorisations (FullPivLU, ColPivHouseholderQR, EigenSolver, ...) branch.  Each branch leaves a
// guard, even if the result does not depend on the branch.  linear_algebra.h has the same functions by name, for any
// scalar.
#pragma once

#include <dyntape/autodiff/record/detail/eigen_traits.h>
#include <dyntape/autodiff/record/eigen_factorisations.h>
