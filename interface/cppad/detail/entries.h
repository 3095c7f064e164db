// SPDX-License-Identifier: BSD-3-Clause
//
// Entries of a matrix that are asked for, and which of its columns are swept together.
#pragma once

#include <cstddef>
#include <vector>

namespace dyntape::cppad::detail {

// Entries (row, col), in any order.
struct Entries {
  std::vector<std::size_t> row, col;
};

// Groups of columns that a sweep may take together, kept between calls.
struct Colors {
  std::vector<std::size_t> color;  // of each column; SIZE_MAX: not asked for
  std::size_t count = 0;
};

}  // namespace dyntape::cppad::detail
