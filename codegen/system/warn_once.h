// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a warning on stderr, one line, once in a process.  Use it for facts that need not stop the user.
//
//   warn_once("no compiler is found; derivatives are not compiled");     dyntape: no compiler is found; ...
#pragma once

#include <string>

namespace dyntape::codegen {

void warn_once(const std::string& sentence);

}  // namespace dyntape::codegen
