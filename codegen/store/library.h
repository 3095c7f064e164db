// SPDX-License-Identifier: BSD-3-Clause
//
// A loaded library of generated code.
//
//   auto library = Library::load("folder/library.so", content_hash);
//   auto library = Library::load(entry.image, entry.library(), content_hash);    bytes that were checked
//   library->descriptor().kernels[0].run(...)
//
// Loads a copy, in memory, of the bytes that were read.  Therefore no change can occur between a check and the load;
// later changes of the file have no effect; every load is separate; the folder's name and mount options (noexec) do
// not matter.  If the system has no files in memory (/proc is missing, or a policy forbids them), loads the file.
//
// The library stays loaded while an object refers to it.  Loading does not change the floating-point state of the
// process; a library that changes the state (for example linked with -ffast-math) is refused.
#pragma once

#include <memory>
#include <string>

#include <dyntape/codegen/store/abi.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {

class Library {
 public:
  // Unavailable: the system does not load the file.  ToolError: the library has another interface, or describes
  // another function.
  static std::shared_ptr<const Library> load(const std::string& path, const std::string& content_hash);
  // `path`: the file from which the bytes were read.
  static std::shared_ptr<const Library> load(const std::string& image, const std::string& path,
                                             const std::string& content_hash);
  ~Library();
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  const dyntape_descriptor& descriptor() const { return *descriptor_; }

 private:
  Library() = default;
  void open(const std::string& image, const std::string& path);

  void* handle_ = nullptr;
  const dyntape_descriptor* descriptor_ = nullptr;
};

}  // namespace dyntape::codegen
