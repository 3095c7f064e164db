// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

// The first node whose value is finite and whose slope is not, with what to write: "node 12 (Sqrt) of 0 has no slope; write
// norm(v, smoothing) ..."; empty if there is none.  The function has been evaluated there without an error; sizes are not checked.
std::string first_without_slope(const Function& function, const double* x, const double* p, const double* w);

}  // namespace dyntape
