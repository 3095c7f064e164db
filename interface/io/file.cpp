// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/file.h>

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <dyntape/autodiff/error.h>

namespace dyntape::io {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw FileError(path + ": " + what + ": " + std::strerror(errno));
}

// Closes a descriptor on every way out.
struct Descriptor {
  int number;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

void write_all(int descriptor, std::string_view text, const std::string& path) {
  while (!text.empty()) {
    const ssize_t n = ::write(descriptor, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, "cannot write");
    text.remove_prefix(static_cast<size_t>(n));
  }
}

void write_and_flush(const std::string& path, std::string_view text) {
  Descriptor out{::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)};
  if (out.number < 0) fail(path, "cannot create");
  write_all(out.number, text, path);
  if (::fsync(out.number) != 0) fail(path, "cannot flush to disk");
}

}  // namespace

std::string read_file(const std::string& path) {
  Descriptor in{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  if (in.number < 0) fail(path, "cannot open");
  std::string text;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(in.number, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, "cannot read");
    if (n == 0) return text;
    text.append(buffer, static_cast<size_t>(n));
  }
}

std::string temporary_name_beside(const std::string& path) {
  static std::atomic<unsigned> count{0};
  const std::filesystem::path target(path);
  const std::string mark = std::to_string(::getpid()) + "-" + std::to_string(count++);
  const std::string name = "." + target.stem().string() + "." + mark + ".tmp" + target.extension().string();
  return (target.parent_path() / name).string();
}

void write_file_atomically(const std::string& path, std::string_view text) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) throw FileError(path + ": cannot make its folder: " + error.message());
  const std::string temporary = temporary_name_beside(path);
  try {
    write_and_flush(temporary, text);
    if (::rename(temporary.c_str(), path.c_str()) != 0) fail(path, "cannot replace");
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
}

}  // namespace dyntape::io
