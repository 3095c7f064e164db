// SPDX-License-Identifier: BSD-3-Clause
//
// Patterns and groups of columns, for fun.hxx.
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/interface/cppad/detail/entries.h>
#include <dyntape/interface/cppad/detail/recording.h>

namespace CppAD::inline dyntape_names::detail {

// Which of the first `range` outputs have a slope in which variables, or depend on them in any way: also by a comparison, a sign or a step.
Pattern first_order_pattern(const Function& function, std::size_t range, bool dependency,
                            const Kernels& kernels);
// Of the sum of some outputs, both triangles.  Of a kernel that does not say: all pairs.
Pattern second_order_pattern(const Function& function, std::size_t range, const std::vector<bool>& of_range,
                             const Kernels& kernels);
// The same function, with patterns in its kernels: for derivation.
Function with_patterns(const Function& function, const Kernels& kernels);
// Groups the columns of the entries (or their rows): those that meet in no row of the pattern share a group.  ArgumentError if the pattern
// is not n_rows x n_cols.  Groups that there are already are kept, and the pattern is not read; ArgumentError if they are of other entries.
void color_lines(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n_rows,
                 std::size_t n_cols, bool rows, Colors& colors);
// The same for a symmetric matrix of n columns, of which an entry is found in its own column or, mirrored, in that of its row.
void color_symmetric(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n,
                     Colors& colors);
RecordingSizes count_sizes(const Function& function, const std::vector<Print>& prints);
// Which of the first `range` outputs depend on no variable.
std::vector<bool> parameters_of(const Function& function, std::size_t range);

}  // namespace CppAD::inline dyntape_names::detail
