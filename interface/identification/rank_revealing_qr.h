// SPDX-License-Identifier: BSD-3-Clause
//
// Finds the columns of a matrix that depend on previous columns, with their combinations: a rank-revealing QR
// (staircase.h), by SuiteSparse's SPQR if dyntape is built with it.
//
//   ColumnSpace space = column_space(A);
//   A(:, space.dependent) == A(:, space.independent) * space.combination          // to rounding
//
// Columns are first scaled to unit length, so that units of parameters have no effect.  A column is dependent if
// less than `tolerance` of it remains after the projection onto the previous columns.  The choice runs from the left
// and does not depend on the rows.  Columns of zeros, and columns shorter than 1e-13 of the longest, are dependent.
// (T. Davis, Algorithm 915: SuiteSparseQR, ACM Trans. Math. Software 38(1), 2011.)
#pragma once

#include <Eigen/Core>
#include <vector>

#include <dyntape/autodiff/eigen_layout.h>

namespace dyntape {

struct ColumnSpace {
  std::vector<int> independent, dependent;  // columns of A, ascending
  Eigen::MatrixXd combination;              // (independent x dependent)
  // The parts of unit-length columns that remain after the projection: a large gap between these two confirms the
  // rank.  Infinite and zero if there are no such columns.
  double least_kept = 0, most_dropped = 0;

  int rank() const { return static_cast<int>(independent.size()); }
};

// ArgumentError: entries that are not finite.  ToolError: SPQR runs out of memory.
ColumnSpace column_space(const Eigen::MatrixXd& A, double tolerance = 1e-9);

}  // namespace dyntape
