// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/detail/sets.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <sstream>

namespace CppAD::inline dyntape_names::detail {

vector<std::size_t> sorted_places(const vector<std::size_t>& first, const vector<std::size_t>& second) {
  vector<std::size_t> places(first.size());
  std::iota(places.begin(), places.end(), std::size_t(0));
  std::sort(places.begin(), places.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(first[a], second[a]) < std::pair(first[b], second[b]);
  });
  return places;
}

void check_entries(std::size_t n, std::size_t expected, std::size_t rows, std::size_t cols) {
  if (n == expected) return;
  refuse("a sparsity pattern has " + std::to_string(n) + " entries, expected " + std::to_string(expected) +
         " for " + std::to_string(rows) + " x " + std::to_string(cols));
}

Sets sets_of(const Pattern& pattern) {
  Sets sets{pattern.cols, std::vector<std::vector<std::size_t>>(pattern.rows)};
  for (std::size_t k = 0; k < pattern.nnz(); ++k) sets.sets[pattern.row[k]].push_back(pattern.col[k]);
  return sets;
}

Pattern pattern_of(const Sets& sets) {
  std::vector<std::vector<std::uint32_t>> rows;
  for (const auto& row : sets.sets) rows.emplace_back(row.begin(), row.end());
  return pattern_from_rows(rows, sets.cols);
}

Sets transposed(const Sets& sets) {
  Sets turned{sets.sets.size(), std::vector<std::vector<std::size_t>>(sets.cols)};
  for (std::size_t i = 0; i < sets.sets.size(); ++i) {
    for (std::size_t j : sets.sets[i]) turned.sets[j].push_back(i);
  }
  return turned;
}

Sets product(const Sets& a, const Sets& b) {
  Sets c{b.cols, std::vector<std::vector<std::size_t>>(a.sets.size())};
  std::vector<std::size_t> met_by(b.cols, SIZE_MAX);
  for (std::size_t i = 0; i < a.sets.size(); ++i) {
    for (std::size_t k : a.sets[i]) {
      for (std::size_t j : b.sets[k]) {
        if (met_by[j] != i) met_by[j] = i, c.sets[i].push_back(j);
      }
    }
    std::sort(c.sets[i].begin(), c.sets[i].end());
  }
  return c;
}

void sort_rows(Sets& sets) {
  for (auto& row : sets.sets) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
  }
}

void keep_selected(Sets& sets, const std::vector<bool>& rows, const std::vector<bool>& cols) {
  for (std::size_t i = 0; i < sets.sets.size(); ++i) {
    if (!rows[i]) sets.sets[i].clear();
    std::erase_if(sets.sets[i], [&](std::size_t j) { return !cols[j]; });
  }
}

std::vector<bool> selected(const Sets& one_row) {
  std::vector<bool> bools(one_row.cols, false);
  for (const auto& row : one_row.sets) {
    for (std::size_t j : row) bools[j] = true;
  }
  return bools;
}

namespace {

bool begins_with_limit(const std::string& word) { return word.rfind("collision_limit=", 0) == 0; }

}  // namespace

bool read_optimize_options(const std::string& options, const std::string& asked) {
  constexpr std::array kKnown = {"no_conditional_skip", "no_compare_op", "no_print_for_op",
                                 "no_cumulative_sum_op", "val_graph"};
  std::istringstream words(options);
  bool found = false;
  for (std::string word; words >> word;) {
    if (std::find(kKnown.begin(), kKnown.end(), word) == kKnown.end() && !begins_with_limit(word))
      refuse("optimize: \"" + word +
             "\" is no option; there are no_conditional_skip, no_compare_op, no_print_for_op, "
             "no_cumulative_sum_op, collision_limit=<number>, val_graph");
    found = found || word == asked;
  }
  return found;
}

bool uses_symmetry(const std::string& coloring) { return coloring.find(".general") == std::string::npos; }

void check_coloring(const char* what, const std::string& name) {
  constexpr std::array kKnown = {"cppad",         "colpack",           "cppad.symmetric",
                                 "cppad.general", "colpack.symmetric", "colpack.general",
                                 "colpack.star"};
  if (std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end()) return;
  refuse(std::string(what) + ": there is no colouring \"" + name +
         "\"; there are cppad, colpack and, of Hessians, cppad.symmetric, cppad.general, colpack.symmetric, "
         "colpack.general, colpack.star");
}

}  // namespace CppAD::inline dyntape_names::detail
