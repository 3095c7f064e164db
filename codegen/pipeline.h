// SPDX-License-Identifier: BSD-3-Clause
//
// The C text of a recorded function and its derivatives, for other programs than this one.
//
//   write_source(generate_source(function, options), "folder");
//
// CompiledFunction (compiled_function.h) is what the rest of dyntape uses: it compiles and loads the text as well.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/print/print_c.h>
#include <dyntape/codegen/print/print_casadi.h>
#include <dyntape/codegen/print/print_embedded.h>

namespace dyntape {

// The C text alone, of the value and all derivatives up to options.order.
codegen::Source generate_source(const Function& function, const CodegenOptions& options = {});

// The same as plain functions for an embedded target (print_embedded.h).
codegen::EmbeddedSource generate_embedded(const Function& function, const CodegenOptions& options = {},
                                          const codegen::EmbeddedOptions& how = {});

// The same with CasADi's interface (print_casadi.h), and as a library that casadi::external() loads: ToolError where there is no
// compiler, or of the compiler.
codegen::Source generate_casadi(const Function& function, const codegen::CasadiBlocks& blocks,
                                const CodegenOptions& options = {});
void compile_casadi(const codegen::Source& source, const std::string& library,
                    const CodegenOptions& options = {});

// Writes folder/<name>.c and folder/<name>.h, if there is one, whole or not at all; returns their paths.
std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder);

}  // namespace dyntape
