// SPDX-License-Identifier: BSD-3-Clause
//
// Names that other tools use for a key or value, for suggestions in error messages.
//
//   synonym_of("dt", {"duration", "step"})        // "step"
//   synonym_of("rk4", {"runge-kutta-4"})          // "runge-kutta-4"
//   synonym_of("dt", {"duration"})                // "": no corresponding name here
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dyntape::io {

std::string synonym_of(std::string_view word, const std::vector<std::string>& valid);

}  // namespace dyntape::io
