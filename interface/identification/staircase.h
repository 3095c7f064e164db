// SPDX-License-Identifier: BSD-3-Clause
//
// R of A = Q R (columns x columns) without column exchanges, as a staircase: a column with no more than `tolerance`
// below the previous steps starts no step and has zeros there.
//
//   staircase(A, 1e-9)     by SuiteSparse's SPQR, or by reflections if built with DYNTAPE_SUITESPARSE=OFF
//
// (M. T. Heath, Some extensions of an algorithm for sparse linear least squares problems, SIAM J. Sci. Stat. Comput. 3(2), 1982.)
#pragma once

#include <Eigen/Core>

namespace dyntape::detail {

// ToolError: SPQR runs out of memory.
Eigen::MatrixXd staircase(const Eigen::MatrixXd& A, double tolerance);
// Householder's method on full matrices; always available.
Eigen::MatrixXd staircase_by_reflections(Eigen::MatrixXd A, double tolerance);

}  // namespace dyntape::detail
