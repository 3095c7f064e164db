// SPDX-License-Identifier: BSD-3-Clause
//
// Checks of the stage-wise solver before a solve (interior_point.h).
#pragma once

#include <string>

#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

[[noreturn]] void refuse_stages(const std::string& what);  // ArgumentError

// Throws ArgumentError for a start of wrong size, options out of range, and options that only Ipopt has.
void check_stage_options(const NlpShape& shape, const std::vector<double>& start,
                         const SolverOptions& options);

// Returns true if a lower bound is above its upper bound, or a bound is NaN.
bool has_crossed_bounds(const NlpShape& shape);

}  // namespace dyntape
