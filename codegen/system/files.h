// SPDX-License-Identifier: BSD-3-Clause
//
// Small things about files that the compiler stage and the cache share.
//
//   write_file(path, text)             throws FileError; the caller owns the folder, so nothing is renamed
//   std::optional<std::string> text = read_file(path, error)      error: 0, or an error number
//   TemporaryFolder folder(parent)     made with a name of its own, removed with all it holds
//   checksum(text)                     128 bits, 32 hexadecimal digits
//
// A temporary folder carries a mark, the file .dyntape, and a lock on it for as long as its process lives: what
// processes that were killed leave behind is told from the work of others, and from what is not dyntape's at all.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/descriptor.h>

namespace dyntape::codegen {

// The surroundings do not allow it, now: no memory, no disk, a policy, a library that is missing.  Nothing is wrong with
// what was to be compiled or loaded, and who can do without goes on without.
struct Unavailable : ToolError {
  using ToolError::ToolError;
};

void write_file(const std::string& path, std::string_view text);
void write_all(int file, const std::string& path, std::string_view text);  // `path` is for the message

// Regular files only, links not followed, nothing waited for.  EFBIG: it has more bytes.
constexpr std::uint64_t kAnySize = ~std::uint64_t{0};
std::optional<std::string> read_file(const std::string& path, int& error, std::uint64_t most = kAnySize);
// The same of an open one.
std::optional<std::string> read_file(int file, int& error, std::uint64_t most = kAnySize);

// What a folder holds, sorted; empty if it cannot be read.
std::vector<std::string> names_in(const std::string& folder);
// Seconds since 1970; of what is not there, 0.
std::int64_t modified(const std::string& path);

std::string checksum(std::string_view text);

// $TMPDIR, or /tmp where it cannot be used or others could exchange what is in it (said once).  Throws FileError
// if neither will do.
std::string system_temporary_folder();

// A name that no other process has: prefix<process>-<random>.
std::string name_of_its_own(const std::string& prefix);

class TemporaryFolder {
 public:
  // In the parent, readable by its owner only.  Throws FileError.
  TemporaryFolder(const std::string& parent, const std::string& prefix);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  // It has become something else, an entry of the cache: leave it.
  void release();
  // A person is to look into it: it is left for a day.
  void keep();

 private:
  std::string path_;
  Descriptor mark_;
};

inline constexpr char kMark[] = ".dyntape";

// Whether a folder is a temporary one of this user whose process has ended, and that nobody is to look into any more.
enum class Left { kNotOurs, kInUse, kKept, kOver };
Left state_of(const std::string& folder);
// Removes those that are over, of names with this prefix.
void remove_left_over(const std::string& parent, const std::string& prefix);

std::string environment_variable(const char* name);  // "" where it is not set

}  // namespace dyntape::codegen
