// SPDX-License-Identifier: BSD-3-Clause
//
// Generates the C text of a recorded function and its derivatives, for use in other programs.  Inside dyntape, use
// CompiledFunction (compiled_function.h): it also compiles and loads the text.
//
//   write_source(generate_source(function, options), "folder");
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/device/print_device.h>
#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/print/print_c.h>
#include <dyntape/codegen/print/print_casadi.h>
#include <dyntape/codegen/print/print_embedded.h>

namespace dyntape {

// The C text of the value and of all derivatives up to options.order.
codegen::Source generate_source(const Function& function, const CodegenOptions& options = {});

// The C text as plain functions for an embedded target (print_embedded.h).
codegen::EmbeddedSource generate_embedded(const Function& function, const CodegenOptions& options = {},
                                          const codegen::EmbeddedOptions& how = {});

// Several functions as static functions of one text (EmbeddedOptions::parts), for generators that print more around
// them.
struct EmbeddedPart {
  std::string name;  // "dt_stage_first"
  Function function;
  Order order;  // values alone, or with the non-zeros of the Jacobian, ...
};
codegen::EmbeddedSource generate_embedded_parts(const std::vector<EmbeddedPart>& parts,
                                                const CodegenOptions& options, bool single);

// The C text with CasADi's interface (print_casadi.h), and a library of it that casadi::external() loads.  ToolError
// if there is no compiler or the compiler fails.
codegen::Source generate_casadi(const Function& function, const codegen::CasadiBlocks& blocks,
                                const CodegenOptions& options = {});
void compile_casadi(const codegen::Source& source, const std::string& library,
                    const CodegenOptions& options = {});

// Kernels of a graphics card, OpenCL C or CUDA C (print_device.h).  DeviceFunction (device_function.h) also runs them.
codegen::DeviceSource generate_device(const Function& function, const CodegenOptions& options = {},
                                      const codegen::DeviceOptions& how = {});

// Writes folder/<name>.c, or another suffix, and, if the source has a header, folder/<name>.h, atomically.  Returns the
// paths.
std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder,
                                      const std::string& suffix = ".c");

}  // namespace dyntape
