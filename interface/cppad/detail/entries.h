// SPDX-License-Identifier: BSD-3-Clause
//
// Entries of a matrix that are asked for, and which of its columns are swept together.
#pragma once

#include <cstddef>
#include <vector>

namespace CppAD::inline dyntape_names::detail {

// Entries (row, col), in any order.
struct Entries {
  std::vector<std::size_t> row, col;
};

// Groups of columns (or rows) that a sweep may take together, kept between calls: the pattern is read by the first only.
struct Colors {
  std::vector<std::size_t> color;  // of each column; SIZE_MAX: not asked for
  std::size_t count = 0;
  std::vector<bool> in_pattern;  // of each entry; the others are zero

  bool empty() const { return color.empty(); }
};

}  // namespace CppAD::inline dyntape_names::detail
