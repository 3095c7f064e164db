// SPDX-License-Identifier: BSD-3-Clause
//
// A loaded library of generated code.
//
//   auto library = Library::load("folder/library.so", content_hash);
//   auto library = Library::load(entry.image, entry.library(), content_hash);    bytes that were checked
//   library->descriptor().kernels[0].run(...)
//
// What is loaded is a copy in memory of the bytes that were read: nothing can come between a check and the loading, a
// file that is changed later changes nothing that is loaded, each loading is one of its own, and neither the name of
// the folder nor a disk that programs may not be run from matters.  Where the system has no such files (/proc is
// missing, or a policy forbids them) the file itself is loaded.
//
// It stays loaded while anybody holds it.  Loading leaves the floating-point state of the process as it is;
// a library that changes it (one linked with -ffast-math does) is refused.
#pragma once

#include <memory>
#include <string>

#include <dyntape/codegen/store/abi.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {

class Library {
 public:
  // Throws Unavailable if the system does not load the file, ToolError if it is of another interface or describes another
  // function.
  static std::shared_ptr<const Library> load(const std::string& path, const std::string& content_hash);
  // `path` is where the bytes were read.
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
