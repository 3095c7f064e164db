// SPDX-License-Identifier: BSD-3-Clause
//
// How long something took.
//
//   const auto begin = std::chrono::steady_clock::now();
//   ...
//   report.seconds = seconds_since(begin);
#pragma once

#include <chrono>

namespace dyntape {

inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace dyntape
