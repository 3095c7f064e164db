// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

// Finds the first node with a finite value and a slope that is not finite; returns a sentence with the replacement
// to write: "node 12 (Sqrt) of 0 has no slope; write norm(v, smoothing) ..."; empty if there is no such node.  The
// function must have been evaluated at this point without an error.  Sizes are not checked.
std::string first_without_slope(const Function& function, const double* x, const double* p, const double* w);

}  // namespace dyntape
