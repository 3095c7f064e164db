// SPDX-License-Identifier: BSD-3-Clause
#define XXH_INLINE_ALL
#include <dyntape/codegen/files.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#define XXH_VECTOR XXH_SSE2  // gcc 12 warns about its own AVX-512 header
#include <xxhash.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <dyntape/autodiff/error.h>

namespace dyntape::codegen {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw FileError(path + ": " + what + ": " + std::strerror(error));
}

}  // namespace

void write_file(const std::string& path, std::string_view text) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file < 0) fail(path, "cannot be written", errno);
  while (!text.empty()) {
    const ssize_t written = write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      const int error = written < 0 ? errno : ENOSPC;
      close(file);
      fail(path, "cannot be written", error);
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  if (close(file) != 0) fail(path, "cannot be written", errno);
}

std::optional<std::string> read_file(const std::string& path, int& error) {
  error = 0;
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  struct stat status {};
  if (file < 0 || fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    error = file < 0 ? errno : EINVAL;
    if (file >= 0) close(file);
    return std::nullopt;
  }
  std::string text(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t have = 0;
  while (have < text.size()) {
    const ssize_t got = read(file, text.data() + have, text.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) error = errno;
    if (got <= 0) break;
    have += static_cast<std::size_t>(got);
  }
  close(file);
  if (error) return std::nullopt;
  text.resize(have);
  return text;
}

std::string checksum(std::string_view text) {
  const XXH128_hash_t h = XXH3_128bits(text.data(), text.size());
  char digits[33];
  std::snprintf(digits, sizeof digits, "%016llx%016llx", static_cast<unsigned long long>(h.high64),
                static_cast<unsigned long long>(h.low64));
  return digits;
}

std::string system_temporary_folder() {
  const char* folder = std::getenv("TMPDIR");
  return folder && *folder ? folder : "/tmp";
}

TemporaryFolder::TemporaryFolder(const std::string& parent, const std::string& prefix) {
  static std::atomic<unsigned> number{0};
  for (int tries = 0; tries < 100; ++tries) {
    const std::string path =
        parent + "/" + prefix + std::to_string(getpid()) + "-" + std::to_string(number++);
    if (mkdir(path.c_str(), 0700) == 0) {
      path_ = path;
      return;
    }
    if (errno != EEXIST) fail(path, "cannot be made", errno);
  }
  fail(parent + "/" + prefix + "*", "cannot be made", EEXIST);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

}  // namespace dyntape::codegen
