// SPDX-License-Identifier: BSD-3-Clause
//
// The text of a controller: sizes, tables, functions of the problem, loops without zeros, and the algorithm
// (algorithm/*.c).  Internal to generate_controller (controller.h).
#pragma once

#include <dyntape/interface/control/printed/controller_functions.h>

namespace dyntape {

// Names, sizes, source and layout; the counts are the caller's.
PrintedController print_controller(const ControllerParts& parts, const ControllerOptions& options);

}  // namespace dyntape
