// SPDX-License-Identifier: BSD-3-Clause
//
// Patterns and groups of columns, for fun.hxx.
#pragma once

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/interface/cppad/detail/entries.h>
#include <dyntape/interface/cppad/detail/recording.h>

namespace dyntape::cppad::detail {

// Which outputs depend on which variables in any way: also by a comparison, a sign or a step.
Pattern dependency_pattern(const Function& function);
// Of the sum of some outputs, both triangles.  Of kernels that derivation cannot enter: all pairs.
Pattern second_order_pattern(const Function& function, std::size_t range, const std::vector<bool>& of_range,
                             const Kernels& kernels);
Pattern rows_of(const Pattern& pattern, std::size_t rows);  // the first
bool is_in(const Pattern& pattern, std::size_t row, std::size_t col);
void check_pattern(const char* what, const Pattern& pattern, std::size_t rows, std::size_t cols);
// Columns of the entries (or rows) that meet in no row of the pattern share a group. Kept if there are some already.
void color_columns(const Entries& entries, const Pattern& pattern, bool rows, Colors& colors);
template <class Base>
RecordingSizes count_sizes(const Function& function, const std::vector<Print>& prints);

}  // namespace dyntape::cppad::detail
