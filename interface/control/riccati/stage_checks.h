// SPDX-License-Identifier: BSD-3-Clause
//
// What the stage-wise solver refuses before it begins (interior_point.h).
#pragma once

#include <string>

#include <dyntape/interface/control/nlp/solver_options.h>

namespace dyntape {

[[noreturn]] void refuse_stages(const std::string& what);  // ArgumentError

// ArgumentError for a start of another size, options out of range, and those that are Ipopt's alone.
void check_stage_options(const NlpShape& shape, const std::vector<double>& start,
                         const SolverOptions& options);

// Whether some bound lies above its counterpart, or is no number.
bool has_crossed_bounds(const NlpShape& shape);

}  // namespace dyntape
