// SPDX-License-Identifier: BSD-3-Clause
//
// What other tools call a key or a value, for the end of an error message.
//
//   synonym_of("dt", {"duration", "step"})        // "step"
//   synonym_of("rk4", {"runge-kutta-4"})          // "runge-kutta-4"
//   synonym_of("dt", {"duration"})                // "": nothing here is meant by it
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dyntape::io {

std::string synonym_of(std::string_view word, const std::vector<std::string>& valid);

}  // namespace dyntape::io
