// SPDX-License-Identifier: BSD-3-Clause
//
// A loaded library of any C text, compiled with the contract flags (flags.h) and kept in the cache.
//
//   const auto library = TextLibrary::make(source, options);
//   auto* step = reinterpret_cast<int (*)(double*)>(library->symbol("lift_step"));
//
// Use it for text that is more than the kernels of one function, e.g. a controller.  `options`: compiler, flags, use and
// folder of the cache.
//
// Errors.  ToolError: there is no compiler, the compiler fails, the library cannot be loaded, or has no such symbol.
#pragma once

#include <memory>
#include <string>

#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

class TextLibrary {
 public:
  // source.text includes no file of its own; source.header is not used.
  static std::shared_ptr<const TextLibrary> make(const Source& source, const CodegenOptions& options = {});
  ~TextLibrary();
  TextLibrary(const TextLibrary&) = delete;
  TextLibrary& operator=(const TextLibrary&) = delete;

  void* symbol(const std::string& name) const;

 private:
  explicit TextLibrary(const std::string& path);
  void* handle_;
};

}  // namespace dyntape::codegen
