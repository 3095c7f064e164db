// SPDX-License-Identifier: BSD-3-Clause
//
// Patterns and groups of columns, for fun.hxx.
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/interface/cppad/detail/entries.h>
#include <dyntape/interface/cppad/detail/recording.h>

namespace CppAD::inline dyntape_names::detail {

// Which outputs depend on which variables in any way: also by a comparison, a sign or a step.
Pattern dependency_pattern(const Function& function);
// Of the sum of some outputs, both triangles.  Of kernels that derivation cannot enter: all pairs.
Pattern second_order_pattern(const Function& function, std::size_t range, const std::vector<bool>& of_range,
                             const Kernels& kernels);
Pattern rows_of(const Pattern& pattern, std::size_t rows);  // the first
// Groups the columns of the entries (or their rows): those that meet in no row of the pattern share a group.  ArgumentError if the pattern
// is not n_rows x n_cols.  Groups that there are already are kept, and the pattern is not read; ArgumentError if they are of other entries.
void color_lines(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n_rows,
                 std::size_t n_cols, bool rows, Colors& colors);
template <class Base>
RecordingSizes count_sizes(const Function& function, const std::vector<Print>& prints);

}  // namespace CppAD::inline dyntape_names::detail
