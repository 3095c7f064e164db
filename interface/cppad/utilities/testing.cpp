// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/utilities/testing.h>

#include <chrono>

namespace CppAD::inline dyntape_names {

double elapsed_seconds() {
  using Clock = std::chrono::steady_clock;
  static const Clock::time_point start = Clock::now();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace CppAD::inline dyntape_names
