// SPDX-License-Identifier: BSD-3-Clause
//
// Which columns of a matrix depend on those before them, and how: rank-revealing QR, by SuiteSparse's SPQR where it is there (staircase.h).
//
//   ColumnSpace space = column_space(A);
//   A(:, space.dependent) == A(:, space.independent) * space.combination          // to rounding
//
// Columns are scaled to unit length first, so that no unit of a parameter decides; a column is dependent where
// less than `tolerance` of it is left after the projection onto the columns before it.  Going from the left,
// the choice of the independent columns does not depend on the rows.  Columns of zeros are dependent, and
// so are those shorter than 1e-13 of the longest.
// (T. Davis, Algorithm 915: SuiteSparseQR, ACM Trans. Math. Software 38(1), 2011.)
#pragma once

#include <Eigen/Core>
#include <vector>

#include <dyntape/autodiff/eigen_layout.h>

namespace dyntape {

struct ColumnSpace {
  std::vector<int> independent, dependent;  // columns of A, ascending
  Eigen::MatrixXd combination;              // (independent x dependent)
  // What is left of the columns, of unit length, after the projection: the gap between these two tells
  // whether the rank is beyond doubt.  Infinite and zero where there are none.
  double least_kept = 0, most_dropped = 0;

  int rank() const { return static_cast<int>(independent.size()); }
};

// ArgumentError for a matrix with entries that are not finite; ToolError where SPQR runs out of memory.
ColumnSpace column_space(const Eigen::MatrixXd& A, double tolerance = 1e-9);

}  // namespace dyntape
