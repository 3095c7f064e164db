// SPDX-License-Identifier: BSD-3-Clause
//
// The sparsity patterns of Jacobian and Hessian: which outputs depend on which variables.
//
//   Pattern j = jacobian_sparsity(f);       // j.row[k], j.col[k]: entries sorted by row, then column
//
// An entry exists if a chain of non-zero derivatives leads from the variable to the output.  sign, floor and
// comparisons end a chain; both branches of a select count.
#pragma once

#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

// (n_y x n_x)
Pattern jacobian_sparsity(const Function& function);
// The same for any nodes of a graph of n_x variables.
Pattern jacobian_sparsity(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t n_x);

// (n_x x n_x), both triangles: the second derivatives of the sum of the outputs, operator by operator, for 64
// variables at a time.  A call counts as nonlinear in all pairs of arguments that a result depends on.  Contains
// entries that cancel between operators; sparse_hessian() (derive.h) does not, and takes ten times as long.
Pattern hessian_sparsity(const Graph& graph, const std::vector<NodeId>& outputs, std::size_t n_x);

}  // namespace dyntape
