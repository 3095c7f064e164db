// SPDX-License-Identifier: BSD-3-Clause
//
// Eigenvalues and eigenvectors of a symmetric matrix by Jacobi's rotations (Golub and Van Loan, 8.5), as a loop: in C++,
// and in C as a kernel on the tape.
//
//   in    the lower triangle row by row, n (n + 1) / 2
//   out   eigenvalues in ascending order (n), eigenvectors of length 1 as columns, the largest entry of each
//         positive (n x n), working memory (n x n)
//
// A sweep rotates every pair of axes in turn.  Sweeps end when the elements off the diagonal no longer count, after
// six to ten sweeps.  A NaN or an infinity spreads to the values that depend on it.
#pragma once

#include <dyntape/autodiff/record/detail/recorded_matrices.h>

namespace dyntape::detail {

void symmetric_eigen(int n, const double* in, double* out);

// l_i - l_j of ascending eigenvalues; 0 if rounding does not separate them, that is, below 16 n epsilon |A|.
AD gap(const VectorXad& l, Eigen::Index i, Eigen::Index j);
// Returns x; a value that is not finite if eigenvalue i is repeated, because it has no derivative there.
AD unless_repeated(const VectorXad& l, Eigen::Index i, const AD& x);

}  // namespace dyntape::detail
