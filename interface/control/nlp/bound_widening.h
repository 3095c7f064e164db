// SPDX-License-Identifier: BSD-3-Clause
//
// The widening of a bound before a solve (SolverOptions::bound_relaxation), so that the bounds have an interior:
//
//   const double lower = bound - widening(relaxation, bound);
//
// Bounds are in units in which a variable's nominal value is one, like verified violations.  A bound can be hundreds
// of units, e.g. for a joint that the initial guess hardly moves.  A fraction of such a bound would exceed the
// verification's tolerance.
#pragma once

#include <algorithm>
#include <cmath>

namespace dyntape {

inline double widening(double relaxation, double bound) {
  constexpr double kMost = 10;
  return relaxation * std::clamp(std::abs(bound), 1.0, kMost);
}

}  // namespace dyntape
