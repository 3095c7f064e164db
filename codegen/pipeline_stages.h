// SPDX-License-Identifier: BSD-3-Clause
//
// The stages from a recorded function to a loaded library, in the order of docs/architecture.md.  Internal.
//
//   Product product = begin(recorded);
//   std::optional<LibraryBuilder> builder = find(product, options);          product.library: it was in the cache
//   std::vector<Derivatives> derived = derive(product, options);        none: make_at_once(product, derived, options)
//   Source source = print(product, derived, builder->content(), options);
//   product = make(product, source, *builder);
//
// Each stage adds its time to product.timings.  produce() runs all stages:
//
//   Product product = produce(function, options);
//   if (product.library) product.library->descriptor().kernels[0].run(...);
//   else Interpreter(product.derived[0].function)(...);                       neither compiler nor machine code
//
// DYNTAPE_DUMP=folder writes the result of each stage: the recorded graph, the derived graphs, their schedules, the
// C text and the compiler's command.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/codegen/build/library_builder.h>
#include <dyntape/codegen/machine/machine_code.h>
#include <dyntape/codegen/timings.h>

namespace dyntape::codegen {

struct Product {
  Function function;                           // as recorded, compact
  std::shared_ptr<const Library> library;      // null: machine code, or interpreted
  std::shared_ptr<const MachineCode> machine;  // null: a library, or interpreted
  std::vector<Derivatives> derived;            // by order; empty if there is a library
  std::string source_path;                     // beside the library in the cache; empty without cache
  std::string compiler;                        // its version
  Timings timings;
};

Product begin(const Function& recorded);

// Finds the compiler and the place in the cache; none: the function is interpreted.
std::optional<LibraryBuilder> find(Product& product, const CodegenOptions& options);

// Derives up to options.order.
std::vector<Derivatives> derive(Product& product, const CodegenOptions& options);

// The first half of print(): the schedules; `outlines`: repeated parts as functions.
KernelSets plan(Product& product, std::vector<Derivatives> derived, const std::string& content,
                const CodegenOptions& options, bool outlines,
                StatementOrder order = StatementOrder::kRecorded);

// `content`: the hash of the function.
Source print(Product& product, std::vector<Derivatives> derived, const std::string& content,
             const CodegenOptions& options);

// Compiles, stores in the cache if the builder has one, and loads.
Product make(Product product, const Source& source, const LibraryBuilder& builder);

// Without a compiler: makes machine code, or leaves the function to the interpreter.
Product make_at_once(Product product, std::vector<Derivatives> derived, const CodegenOptions& options);

// Runs all stages; may throw NotCached.
Product produce(const Function& recorded, const CodegenOptions& options);

}  // namespace dyntape::codegen
