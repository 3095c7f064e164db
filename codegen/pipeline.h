// SPDX-License-Identifier: BSD-3-Clause
//
// From a recorded function to a loaded library: every stage a call, in the order of docs/architecture.md.
//
//   Product product = produce(function, options);
//   if (product.library) product.library->descriptor().kernels[0].run(...);
//   else Interpreter(product.interpreted[0].function)(...);                   there is no compiler
//
// DYNTAPE_DUMP=folder writes what each stage made: the recorded graph, the derived ones, their schedules, the
// C text and the compiler's command.
//
// CompiledFunction (compiled_function.h) is what the rest of dyntape uses.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/options.h>
#include <dyntape/codegen/print/print_c.h>
#include <dyntape/codegen/print/print_embedded.h>
#include <dyntape/codegen/store/library.h>

namespace dyntape {

// options.only_cached, and the cache has no library of exactly this function and these options.
struct NotCached : ArgumentError {
  using ArgumentError::ArgumentError;
};

// Seconds that each stage took; zero for those that were not needed.
struct Timings {
  double hash = 0;  // the cache key: content hash and the compiler's identity
  double derive = 0, schedule = 0, print = 0, compile = 0;
  double load = 0;         // check, load, query
  bool cache_hit = false;  // nothing was derived, printed or compiled
};

namespace codegen {

struct Product {
  Function function;                       // as recorded, compact
  std::shared_ptr<const Library> library;  // null: interpreted
  std::vector<Derivatives> interpreted;    // by order, where there is no library
  std::string source_path;                 // beside the library in the cache; empty without cache
  std::string compiler;                    // its version
  Timings timings;
};

Product produce(const Function& recorded, const CodegenOptions& options);

}  // namespace codegen

// The C text alone, of the value and all derivatives up to options.order.
codegen::Source generate_source(const Function& function, const CodegenOptions& options = {});

// The same as plain functions for an embedded target (print_embedded.h).
codegen::EmbeddedSource generate_embedded(const Function& function, const CodegenOptions& options = {},
                                          const codegen::EmbeddedOptions& how = {});

// Writes folder/<name>.c and folder/<name>.h, whole or not at all; returns their paths.
std::vector<std::string> write_source(const codegen::Source& source, const std::string& folder);

}  // namespace dyntape
