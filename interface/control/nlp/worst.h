// SPDX-License-Identifier: BSD-3-Clause
//
// The larger of two errors; NaN if either is NaN.  std::max(0.0, NaN) is 0, so an unknown error would look like
// none.
//
//   worst(worst(0.0, a), b)
#pragma once

#include <cmath>

namespace dyntape {

inline double worst(double a, double b) { return std::isnan(a) || a >= b ? a : b; }

}  // namespace dyntape
