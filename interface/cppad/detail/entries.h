// SPDX-License-Identifier: BSD-3-Clause
//
// The requested entries of a matrix, and the groups of columns that share a sweep.
#pragma once

#include <cstddef>
#include <vector>

namespace CppAD::inline dyntape_names::detail {

// Entries (row, col), in any order.
struct Entries {
  std::vector<std::size_t> row, col;
};

// Groups of columns (or rows) that share a sweep, stored between calls.  Only the first call reads the pattern.
struct Colors {
  struct Source {  // entry `entry` is what the sweep finds at `at`
    std::size_t entry, at;
  };
  std::vector<std::size_t> color;  // of each column; SIZE_MAX: in no sweep
  std::vector<std::vector<Source>>
      sources;  // of each color; entries outside the pattern have no source, and are zero
  std::size_t entries = 0;

  bool empty() const { return color.empty(); }
  std::size_t count() const { return sources.size(); }
};

}  // namespace CppAD::inline dyntape_names::detail
