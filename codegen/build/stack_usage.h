// SPDX-License-Identifier: BSD-3-Clause
//
// Measures the stack that a compiler gives to embedded text.
//
//   StackUse use = measure_stack(e, {"arm-none-eabi-gcc", "-mcpu=cortex-m7", "-O2"});
//   use.bytes[0]              deepest chain of calls below the first entry point, itself included
//
// Needs gcc 10 or later (-fcallgraph-info=su).  The stack of libm's functions, which are not in the text, is not
// included.  ToolError: the command is no such compiler, or does not accept the text.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/print/print_embedded.h>

namespace dyntape::codegen {

// `compiler`: its name or path, and flags; -O2 if the flags have no level.
StackUse measure_stack(const EmbeddedSource& embedded, std::vector<std::string> compiler);

// The same from the file that the compiler wrote.
StackUse read_call_graph(const std::string& call_graph, const std::vector<std::string>& entries);

}  // namespace dyntape::codegen
