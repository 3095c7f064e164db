// SPDX-License-Identifier: BSD-3-Clause
//
// File utilities of the compiler stage and the cache.
//
//   write_file(path, text)             throws FileError; not atomic, since the caller owns the folder
//   std::optional<std::string> text = read_file(path, error)      error: 0, or an error number
//   TemporaryFolder folder(parent)     created with a unique name, removed with its content
//   checksum(text)                     128 bits, 32 hexadecimal digits
//
// A temporary folder has a mark, the file .dyntape, locked while its process lives.  The mark distinguishes folders
// of killed processes from folders in use, and from folders of other programs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/descriptor.h>

namespace dyntape::codegen {

// The environment is temporarily unsuitable: no memory, no disk space, a policy, a missing library.  The input is
// valid, and callers with an alternative continue with it.
struct Unavailable : ToolError {
  using ToolError::ToolError;
};

void write_file(const std::string& path, std::string_view text);
void write_all(int file, const std::string& path, std::string_view text);  // `path` is for the message

// For regular files; does not follow links and does not block.  EFBIG: the file is larger than allowed.
constexpr std::uint64_t kAnySize = ~std::uint64_t{0};
std::optional<std::string> read_file(const std::string& path, int& error, std::uint64_t most = kAnySize);
// The same for an open file.
std::optional<std::string> read_file(int file, int& error, std::uint64_t most = kAnySize);

// The content of a folder, sorted; empty if it cannot be read.
std::vector<std::string> names_in(const std::string& folder);
// Seconds since 1970; 0 if the file does not exist.
std::int64_t modified(const std::string& path);

std::string checksum(std::string_view text);

// $TMPDIR; /tmp if $TMPDIR is unusable or others could replace its content (reported once).  Throws FileError if
// both are unusable.
std::string system_temporary_folder();

// A unique name: prefix<process>-<random>.
std::string name_of_its_own(const std::string& prefix);

class TemporaryFolder {
 public:
  // Creates the folder in the parent, readable by its owner only.  Throws FileError.
  TemporaryFolder(const std::string& parent, const std::string& prefix);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  // Returns true while this process has any of them.  For any thread.
  static bool any();
  // The folder has become an entry of the cache: do not remove it.
  void release();
  // Keeps the folder for a day, for inspection.
  void keep();

 private:
  struct Counted {
    Counted();
    ~Counted();
  };
  const Counted counted_;  // from before the folder is made until after it is removed
  std::string path_;
  Descriptor mark_;
};

inline constexpr char kMark[] = ".dyntape";

// Returns true if a folder is a temporary one of this user, its process has ended, and the time for inspection is
// over.
enum class Left { kNotOurs, kInUse, kKept, kOver };
Left state_of(const std::string& folder);
// Removes such folders whose names have this prefix.
void remove_left_over(const std::string& parent, const std::string& prefix);

std::string environment_variable(const char* name);  // "" if not set

}  // namespace dyntape::codegen
