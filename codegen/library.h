// SPDX-License-Identifier: BSD-3-Clause
//
// A loaded library of generated code.
//
//   auto library = Library::load("folder/library.so", content_hash);
//   library->descriptor().kernels[0].run(...)
//
// It stays loaded while anybody holds it.  Loading leaves the floating-point state of the process as it is;
// a library that changes it (one linked with -ffast-math does) is refused.
#pragma once

#include <memory>
#include <string>

#include <dyntape/codegen/abi.h>

namespace dyntape::codegen {

class Library {
 public:
  // Throws ToolError if the file cannot be loaded, is of another interface or describes another function.
  static std::shared_ptr<const Library> load(const std::string& path, const std::string& content_hash);
  ~Library();
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  const dyntape_descriptor& descriptor() const { return *descriptor_; }

 private:
  Library() = default;
  void* handle_ = nullptr;
  const dyntape_descriptor* descriptor_ = nullptr;
};

}  // namespace dyntape::codegen
