// SPDX-License-Identifier: BSD-3-Clause
//
// "Did you mean": the valid name nearest to a misspelt one.
//
//   nearest_name("toleranse", {"tolerance", "maxIterations"})   // "tolerance"
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dyntape::io {

// Insertions, deletions, substitutions and swaps of neighbours that turn a into b; letter case counts half an
// edit (rounded up).
int edit_distance(std::string_view a, std::string_view b);

// The name with the smallest distance, or "" if none is close enough to be meant (a third of the length, at
// least two edits).
std::string nearest_name(std::string_view name, const std::vector<std::string>& valid);

// "; did you mean 'tolerance'?" or "; valid are 'a', 'b'" (at most eight of them), ready to end a message.
std::string suggestion(std::string_view name, const std::vector<std::string>& valid);

}  // namespace dyntape::io
