// SPDX-License-Identifier: BSD-3-Clause
//
// Small things about files that the compiler stage and the cache share.
//
//   write_file(path, text)             throws FileError; the caller owns the folder, so nothing is renamed
//   std::optional<std::string> text = read_file(path, error)      error: 0, or an error number
//   TemporaryFolder folder(parent)     made with a name of its own, removed with all it holds
//   checksum(text)                     128 bits, 32 hexadecimal digits
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace dyntape::codegen {

void write_file(const std::string& path, std::string_view text);
// Regular files only, links not followed.
std::optional<std::string> read_file(const std::string& path, int& error);

std::string checksum(std::string_view text);

// $TMPDIR or /tmp.
std::string system_temporary_folder();

class TemporaryFolder {
 public:
  // parent/prefix<process>-<number>, readable by its owner only.  Throws FileError.
  TemporaryFolder(const std::string& parent, const std::string& prefix);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  // It has become something else (an entry of the cache, a report): leave it.
  void release() { path_.clear(); }

 private:
  std::string path_;
};

}  // namespace dyntape::codegen
