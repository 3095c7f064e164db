// SPDX-License-Identifier: BSD-3-Clause
//
// Is a point optimal?  The first-order conditions, computed anew from the program and the multipliers.
//
//   const KktResiduals r = kkt_residuals(nlp, solution);
//
//   stationarity     max |grad f + J^T lambda - lower_multiplier + upper_multiplier|, over variables that are not fixed
//   feasibility      max violation of the bounds of g and x
//   complementarity  max |bound multiplier * distance to its bound|, of variables and of constraint rows within their bounds; a bound multiplier
//                    below zero, or of a bound that is not there, counts as it is
//
// In the units of the program: of a scaled one (scaled_nlp.h), relative to its nominal values.  NaN where a multiplier or
// a derivative is.
//
// J. Nocedal and S. J. Wright, "Numerical Optimization", 2nd edition, theorem 12.1.
#pragma once

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

struct KktResiduals {
  double stationarity = 0, feasibility = 0, complementarity = 0;
};

KktResiduals kkt_residuals(Nlp& problem, const NlpSolution& solution);

// Variables and constraint rows that rest on a bound within `tolerance`, relative to max(1, |bound|); what is
// fixed or an equality does not count.
struct ActiveBounds {
  std::vector<std::size_t> variables, rows;
};
ActiveBounds active_bounds(const Nlp& problem, const NlpSolution& solution, double tolerance = 1e-6);

}  // namespace dyntape
