// SPDX-License-Identifier: BSD-3-Clause
//
// Computes the first-order optimality conditions (KKT residuals) from the program and the multipliers.
//
//   const KktResiduals r = kkt_residuals(nlp, solution);
//
//   stationarity     max |grad f + J^T lambda - lower_multiplier + upper_multiplier|, over variables that are not fixed
//   feasibility      max violation of the bounds of g and x
//   complementarity  max |bound multiplier * distance to its bound|, of variables and of constraint rows within their
//                    bounds; a negative multiplier, or a multiplier without bound, counts with its own size
//
// Units: those of the program; for a scaled one (scaled_nlp.h) relative to nominal values.  NaN if a multiplier or a
// derivative is NaN.
//
// Source: J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd edition, theorem 12.1.
#pragma once

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

struct KktResiduals {
  double stationarity = 0, feasibility = 0, complementarity = 0;
};

KktResiduals kkt_residuals(Nlp& problem, const NlpSolution& solution);

// Variables and constraint rows within `tolerance` of a bound, relative to max(1, |bound|).  Fixed variables and
// equalities are not listed.
struct ActiveBounds {
  std::vector<std::size_t> variables, rows;
};
ActiveBounds active_bounds(const Nlp& problem, const NlpSolution& solution, double tolerance = 1e-6);

}  // namespace dyntape
