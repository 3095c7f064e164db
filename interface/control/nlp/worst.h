// SPDX-License-Identifier: BSD-3-Clause
//
// The larger of two measures of error, and NaN where either is: std::max(0.0, NaN) is 0, so that what cannot be
// judged would look flawless.
//
//   worst(worst(0.0, a), b)
#pragma once

#include <cmath>

namespace dyntape {

inline double worst(double a, double b) { return std::isnan(a) || a >= b ? a : b; }

}  // namespace dyntape
