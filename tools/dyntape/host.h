// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace dyntape::tools {

// "AMD EPYC", "gcc version 12.2.0 ...": what a measurement depends on.
std::string processor_name();
std::string compiler_name();

}  // namespace dyntape::tools
