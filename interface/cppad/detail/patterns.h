// SPDX-License-Identifier: BSD-3-Clause
//
// Patterns, and groups of columns that share a sweep, for fun.hxx.
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/interface/cppad/detail/entries.h>
#include <dyntape/interface/cppad/detail/recording.h>

namespace CppAD::inline dyntape_names::detail {

// The variables in which the first `range` outputs have a slope; with `dependency`, also the variables that they
// depend on by a comparison, a sign or a step.
Pattern first_order_pattern(const Function& function, std::size_t range, bool dependency,
                            const Kernels& kernels);
// The Hessian pattern of the sum of some outputs, both triangles.  A kernel without a pattern counts as all pairs.
Pattern second_order_pattern(const Function& function, std::size_t range, const std::vector<bool>& of_range,
                             const Kernels& kernels);
// The same function with patterns in its kernels, for derivation.
Function with_patterns(const Function& function, const Kernels& kernels);
// Groups the columns of the entries (or the rows): columns that share no row of the pattern share a group.  If
// `colors` has groups, keeps these and does not read the pattern.  ArgumentError: the pattern is not n_rows x
// n_cols, or the given groups belong to other entries.
void color_lines(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n_rows,
                 std::size_t n_cols, bool rows, Colors& colors);
// The same for a symmetric matrix of n columns: an entry is found in its own column, or mirrored in the column of
// its row.
void color_symmetric(const char* what, const Entries& entries, const Pattern& pattern, std::size_t n,
                     Colors& colors);
RecordingSizes count_sizes(const Function& function, const std::vector<Print>& prints);
// Whether each of the first `range` outputs depends on no variable.
std::vector<bool> parameters_of(const Function& function, std::size_t range);

}  // namespace CppAD::inline dyntape_names::detail
