// SPDX-License-Identifier: BSD-3-Clause
//
// What a generated header says besides its declarations: what each entry of the arrays is, and their sizes as macros.
//
//   /* x[3]: q0, v0, a0
//    * ...                                          */
//   #define PENDULUM_RNEA_N_X 3
//   #define PENDULUM_RNEA_JACOBIAN_NNZ 2
//   #define PENDULUM_RNEA_VALUE_WORK 1
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/print/print_tables.h>

namespace dyntape::codegen {

// A C identifier in capitals: what macros of a file begin with.
std::string macro_prefix(const std::string& name);

// `kernels`: for the work array of each; none where entry points need none.
std::string header_sizes(const KernelSets& sets, const Source& source,
                         const std::vector<KernelEntry>& kernels);

}  // namespace dyntape::codegen
