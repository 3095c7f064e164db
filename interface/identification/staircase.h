// SPDX-License-Identifier: BSD-3-Clause
//
// R of A = Q R (columns x columns) with no exchange of columns: a staircase, in which a column of which no more than `tolerance` is left
// below the steps before it starts no step and has zeros there.
//
//   staircase(A, 1e-9)     by SuiteSparse's SPQR, or by reflections where dyntape is built without it (DYNTAPE_SUITESPARSE=OFF)
//
// (M. T. Heath, Some extensions of an algorithm for sparse linear least squares problems, SIAM J. Sci. Stat. Comput. 3(2), 1982.)
#pragma once

#include <Eigen/Core>

namespace dyntape::detail {

// ToolError where SPQR runs out of memory.
Eigen::MatrixXd staircase(const Eigen::MatrixXd& A, double tolerance);
// Householder's, on full matrices: always there.
Eigen::MatrixXd staircase_by_reflections(Eigen::MatrixXd A, double tolerance);

}  // namespace dyntape::detail
