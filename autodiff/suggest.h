// SPDX-License-Identifier: BSD-3-Clause
//
// "Did you mean": finds the valid name nearest to a misspelt one, for error messages (error.h).
//
//   nearest_name("toleranse", {"tolerance", "maxIterations"})   // "tolerance"
//   suggestion("toleranse", {"tolerance", "maxIterations"})     // "; did you mean 'tolerance'?"
//
// This header includes no other header of dyntape; every part may include it.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace dyntape {

namespace detail {

inline char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

// In half edits, so that a wrong case costs less than a wrong letter.
inline int substitution_cost(char a, char b) { return a == b ? 0 : lower(a) == lower(b) ? 1 : 2; }

inline bool same_but_for_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace detail

// Edit distance: insertions, deletions, substitutions and swaps of neighbours; letter case counts half an edit
// (rounded up).  Optimal string alignment by dynamic programming over prefixes, three rows at a time.
inline int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) above[j] = 2 * static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = 2 * static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min(
          {above[j] + 2, row[j - 1] + 2, above[j - 1] + detail::substitution_cost(a[i - 1], b[j - 1])});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 2);
    }
    before.swap(above);
    above.swap(row);
  }
  return (above[b.size()] + 1) / 2;
}

// The name with the smallest distance, or "" if the distance exceeds a third of the length and two edits.
inline std::string nearest_name(std::string_view name, const std::vector<std::string>& valid) {
  std::string best;
  int least = std::max(2, static_cast<int>(name.size()) / 3) + 1;
  for (const std::string& candidate : valid) {
    const int distance = edit_distance(name, candidate);
    // A two-letter name is two edits from every other; require a common letter.
    const bool shares_letters = distance < static_cast<int>(std::max(name.size(), candidate.size()));
    const bool related = shares_letters || detail::same_but_for_case(name, candidate);
    if (related && distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

// "; did you mean 'tolerance'?" or "; valid are 'a', 'b'" (at most eight of them).
inline std::string suggestion(std::string_view name, const std::vector<std::string>& valid) {
  const std::string nearest = nearest_name(name, valid);
  if (!nearest.empty()) return "; did you mean '" + nearest + "'?";
  if (valid.empty()) return "";
  std::string text = "; valid are ";
  constexpr size_t kShown = 8;
  for (size_t i = 0; i < std::min(valid.size(), kShown); ++i) text += (i ? ", '" : "'") + valid[i] + "'";
  return text + (valid.size() > kShown ? ", ..." : "");
}

}  // namespace dyntape
