// SPDX-License-Identifier: BSD-3-Clause
//
// Patterns as sets, one set for each row.  The sparse calls convert the user's vectors to these.
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include <dyntape/autodiff/graph/pattern.h>
#include <dyntape/interface/cppad/sparse.h>

namespace CppAD::inline dyntape_names::detail {

struct Sets {
  std::size_t cols = 0;
  std::vector<std::vector<std::size_t>> sets;  // ascending, each once
};

// --- sets.cpp ---
Sets sets_of(const Pattern& pattern);
Pattern pattern_of(const Sets& sets);
Sets transposed(const Sets& sets);
Sets product(const Sets& a, const Sets& b);
void sort_rows(Sets& sets);
void keep_selected(Sets& sets, const std::vector<bool>& rows, const std::vector<bool>& cols);
std::vector<bool> selected(const Sets& one_row);
// Whether `asked` is among the options; ArgumentError for words that are none.
bool read_optimize_options(const std::string& options, const std::string& asked);
void check_coloring(const char* what, const std::string& name);
bool uses_symmetry(const std::string& coloring);

template <class V>
std::vector<std::size_t> sizes_of(const V& v) {
  return copied<std::vector<std::size_t>>(v);
}
template <class V>
std::vector<bool> bools_of(const V& v) {
  return copied<std::vector<bool>>(v);
}

template <class V>
Sets sets_of(const sparse_rc<V>& rc, bool transpose) {
  Sets sets{transpose ? rc.nr() : rc.nc(), {}};
  sets.sets.resize(transpose ? rc.nc() : rc.nr());
  for (std::size_t k = 0; k < rc.nnz(); ++k)
    sets.sets[transpose ? rc.col()[k] : rc.row()[k]].push_back(transpose ? rc.row()[k] : rc.col()[k]);
  sort_rows(sets);
  return sets;
}

template <class V>
void to_rc(const Sets& of, bool transpose, sparse_rc<V>& rc) {
  const Sets sets = transpose ? transposed(of) : of;
  std::size_t nnz = 0, k = 0;
  for (const auto& row : sets.sets) nnz += row.size();
  rc.resize(sets.sets.size(), sets.cols, nnz);
  for (std::size_t i = 0; i < sets.sets.size(); ++i) {
    for (std::size_t j : sets.sets[i]) rc.set(k++, i, j);
  }
}

void check_entries(std::size_t n, std::size_t expected, std::size_t rows, std::size_t cols);

template <class Vector>
inline constexpr bool kIsOfSets = requires(const Vector& v) {
  v[0].begin();
};

// A vector of rows x cols bools, or of that many sets; transposed if asked.
template <class Vector>
Sets sets_of(const Vector& v, std::size_t rows, std::size_t cols, bool transpose) {
  check_entries(std::size_t(v.size()), kIsOfSets<Vector> ? rows : rows * cols, rows, cols);
  Sets sets{cols, std::vector<std::vector<std::size_t>>(rows)};
  for (std::size_t i = 0; i < rows; ++i) {
    if constexpr (kIsOfSets<Vector>) {
      for (std::size_t j : v[i]) {
        if (j >= cols)
          refuse("a sparsity pattern has column " + std::to_string(j) + " of " + std::to_string(cols));
        sets.sets[i].push_back(j);
      }
    } else {
      for (std::size_t j = 0; j < cols; ++j) {
        if (v[i * cols + j]) sets.sets[i].push_back(j);
      }
    }
  }
  sort_rows(sets);
  return transpose ? transposed(sets) : sets;
}

template <class Vector>
Vector to_vector(const Sets& of, bool transpose) {
  const Sets sets = transpose ? transposed(of) : of;
  const std::size_t rows = sets.sets.size();
  if constexpr (kIsOfSets<Vector>) {
    Vector v(rows);
    for (std::size_t i = 0; i < rows; ++i) v[i].insert(sets.sets[i].begin(), sets.sets[i].end());
    return v;
  } else {
    Vector v(rows * sets.cols);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = 0; j < sets.cols; ++j) v[i * sets.cols + j] = false;
      for (std::size_t j : sets.sets[i]) v[i * sets.cols + j] = true;
    }
    return v;
  }
}

}  // namespace CppAD::inline dyntape_names::detail
