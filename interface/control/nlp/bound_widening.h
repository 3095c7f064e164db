// SPDX-License-Identifier: BSD-3-Clause
//
// By how much a solver widens a bound before it begins (SolverOptions::bound_relaxation), so that there is room on both sides:
//
//   const double lower = bound - widening(relaxation, bound);
//
// Bounds are in units in which a variable's nominal value is one, as verified violations are.  A bound can be hundreds of times that, of
// a joint that the first guess hardly moves; a part of it would then be more than the verification allows.
#pragma once

#include <algorithm>
#include <cmath>

namespace dyntape {

inline double widening(double relaxation, double bound) {
  constexpr double kMost = 10;
  return relaxation * std::clamp(std::abs(bound), 1.0, kMost);
}

}  // namespace dyntape
