// SPDX-License-Identifier: BSD-3-Clause
//
// A sparsity pattern: positions of a matrix that may be nonzero, sorted by row and then by column.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace dyntape {

struct Pattern {
  std::size_t rows = 0, cols = 0;
  std::vector<std::uint32_t> row, col;  // (nnz) each

  std::size_t nnz() const { return row.size(); }
  bool operator==(const Pattern&) const = default;
};

// Makes a pattern from the sorted columns of each row.
inline Pattern pattern_from_rows(const std::vector<std::vector<std::uint32_t>>& columns_of_row,
                                 std::size_t cols) {
  Pattern pattern{columns_of_row.size(), cols, {}, {}};
  for (std::size_t i = 0; i < columns_of_row.size(); ++i) {
    for (std::uint32_t j : columns_of_row[i]) {
      pattern.row.push_back(static_cast<std::uint32_t>(i));
      pattern.col.push_back(j);
    }
  }
  return pattern;
}

inline std::vector<std::vector<std::uint32_t>> columns_of_rows(const Pattern& pattern) {
  std::vector<std::vector<std::uint32_t>> rows(pattern.rows);
  for (std::size_t k = 0; k < pattern.nnz(); ++k) rows[pattern.row[k]].push_back(pattern.col[k]);
  return rows;
}

}  // namespace dyntape
