// SPDX-License-Identifier: BSD-3-Clause
//
// The stack that a compiler gives to embedded text.
//
//   StackUse use = measure_stack(e, {"arm-none-eabi-gcc", "-mcpu=cortex-m7", "-O2"});
//   use.bytes[0]              deepest chain of calls below the first entry point, itself included
//
// gcc 10 or later (-fcallgraph-info=su).  Functions of libm are not in the text: their stack comes on top.
// Throws ToolError if the command is no such compiler, or does not accept the text.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/print/print_embedded.h>

namespace dyntape::codegen {

// `compiler`: its name or path, and flags; -O2 where they name no level.
StackUse measure_stack(const EmbeddedSource& embedded, std::vector<std::string> compiler);

// The same of the file that the compiler wrote.
StackUse read_call_graph(const std::string& call_graph, const std::vector<std::string>& entries);

}  // namespace dyntape::codegen
