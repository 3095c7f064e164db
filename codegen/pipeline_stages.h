// SPDX-License-Identifier: BSD-3-Clause
//
// The stages of the pipeline one by one, for those who do other things in between (tiered_function.cpp).
// produce() (pipeline.h) is all of them in order:
//
//   Product product = begin(recorded);
//   std::optional<LibraryBuilder> builder = find(product, options);          product.library: it was in the cache
//   std::vector<Derivatives> derived = derive(product, options);        none: product.interpreted = derived
//   Source source = print(product, derived, *builder, options);
//   product = make(product, source, *builder);
//
// Each adds the time it takes to product.timings.
#pragma once

#include <optional>
#include <vector>

#include <dyntape/codegen/build/library_builder.h>
#include <dyntape/codegen/pipeline.h>

namespace dyntape::codegen {

Product begin(const Function& recorded);

// The compiler and the place in the cache; none: to be interpreted.
std::optional<LibraryBuilder> find(Product& product, const CodegenOptions& options);

// By order, simplified.
std::vector<Derivatives> derive(Product& product, const CodegenOptions& options);

Source print(Product& product, std::vector<Derivatives> derived, const LibraryBuilder& builder,
             const CodegenOptions& options);

// Compiled, put into the cache if the builder has one, and loaded.
Product make(Product product, const Source& source, const LibraryBuilder& builder);

}  // namespace dyntape::codegen
