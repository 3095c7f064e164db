// SPDX-License-Identifier: BSD-3-Clause
//
// Eigenvalues and eigenvectors of a symmetric matrix by Jacobi's rotations (Golub and Van Loan, 8.5), as a loop: in C++,
// and in C as a kernel on the tape.
//
//   in    the lower triangle row by row, n (n + 1) / 2
//   out   eigenvalues in ascending order (n), eigenvectors of length 1 as columns, the largest entry of each
//         positive (n x n), working memory (n x n)
//
// A sweep turns every pair of axes in line until what is off the diagonal no longer counts, after six to ten sweeps; a NaN
// or an infinity spreads to what it meets.
#pragma once

#include <dyntape/autodiff/record/detail/recorded_matrices.h>

namespace dyntape::detail {

void symmetric_eigen(int n, const double* in, double* out);

// Of ascending eigenvalues: l_i - l_j, 0 where rounding does not tell the two apart, that is, below 16 n epsilon |A|.
AD gap(const VectorXad& l, Eigen::Index i, Eigen::Index j);
// x, but no finite number where eigenvalue i is repeated: there it has no derivative.
AD unless_repeated(const VectorXad& l, Eigen::Index i, const AD& x);

}  // namespace dyntape::detail
