// SPDX-License-Identifier: BSD-3-Clause
//
// Products with sparse matrices of constant pattern as C loops with constant bounds, without the zeros.
//
//   SparseRows ab(pattern, 0, n_x);                     // the first n_x rows of a Jacobian
//   print_apply("dt_apply", ab)                         // y += A z
//
// A matrix is the array of its non-zeros, row by row.  Neighbouring non-zeros of a row are a loop; rows with the same
// columns are one loop around it.  Sums go over rows, or columns, in increasing order, as those of a full matrix would: the
// bits are the same.
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

// Neighbouring columns of a row.
struct SparseRun {
  std::size_t first, count;
  bool operator==(const SparseRun&) const = default;
};

struct SparseRow {
  std::vector<SparseRun> runs;
  std::size_t offset, count;  // of its non-zeros in the array
};

// Rows first, ..., last - 1 of a pattern, whose non-zeros begin at 0.
struct SparseRows {
  SparseRows(const Pattern& pattern, std::size_t first, std::size_t last);
  std::vector<SparseRow> rows;
  std::size_t cols, nnz = 0, offset = 0;  // offset: in the array of the whole pattern
};

// Functions of C.  `a` is the array of non-zeros.
std::string print_apply(const std::string& name, const SparseRows& a);      // (a, z, y): y += A z
std::string print_transpose(const std::string& name, const SparseRows& a);  // (a, v, q): q += A' v
std::string print_pull(const std::string& name, const SparseRows& a);       // (a, v, q): q -= A' v
// (a, w, q): lower triangle of q += A' diag(w) A; q is a matrix with that many columns.
std::string print_square(const std::string& name, const SparseRows& a);
// (a, p, q): lower triangle of q += A' p A, with p symmetric.
std::string print_transform(const std::string& name, const SparseRows& a);

// Gradient g and lower triangle h, in rows, of 1/2 r.r + d: the residuals are y[value], ..., the non-zeros
// jacobian[offset], ...; d is an output between squares and curvatures, which have no value.
struct CostRows {
  SparseRows squares, plain, curvatures;
  std::size_t value;  // index of the first residual in y
};
std::string print_cost(const std::string& name, const CostRows& rows);

}  // namespace dyntape
