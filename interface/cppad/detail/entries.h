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
  struct Source {  // entry `entry` is what the sweep finds at `at`
    std::size_t entry, at;
  };
  std::vector<std::size_t> color;  // of each column; SIZE_MAX: in no sweep
  std::vector<std::vector<Source>>
      sources;  // of each color; entries beyond the pattern have none, and are zero
  std::size_t entries = 0;

  bool empty() const { return color.empty(); }
  std::size_t count() const { return sources.size(); }
};

}  // namespace CppAD::inline dyntape_names::detail
