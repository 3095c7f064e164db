// SPDX-License-Identifier: BSD-3-Clause
//
// What a user should know and need not be stopped for: one line on stderr, once in a process.
//
//   warn_once("no compiler is found; derivatives are not compiled");     dyntape: no compiler is found; ...
#pragma once

#include <string>

namespace dyntape::codegen {

void warn_once(const std::string& sentence);

}  // namespace dyntape::codegen
