// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/text_file.h>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <random>

#include <dyntape/autodiff/error.h>

namespace dyntape {
namespace {

namespace fs = std::filesystem;

constexpr int kPatience = 1000;  // ms, for somebody to open a pipe for writing
constexpr std::size_t kMostBytes = std::size_t{1} << 30;
constexpr int kMostLinks = 40;  // as the kernel follows

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

// --- Reading ---------------------------------------------------------------------------------------------

// Appends what is there; false at the end.
bool read_some(int file, std::string& text, const std::string& path) {
  char buffer[1 << 16];
  ssize_t n = 0;
  while ((n = ::read(file, buffer, sizeof buffer)) < 0 && errno == EINTR) continue;
  if (n < 0) fail(path, "cannot read");
  const auto count = static_cast<std::size_t>(n);
  if (std::memchr(buffer, 0, count)) throw FileError(path + ": contains a zero byte; expected a text file");
  if (text.size() + count > kMostBytes)
    throw FileError(path + ": more than a gigabyte; expected a text file");
  text.append(buffer, count);
  return n > 0;
}

// A pipe is at its end as long as nobody has opened it for writing; one that waits for data is not.
void await_writer(int pipe, std::string& text, const std::string& path) {
  pollfd events{pipe, POLLIN, 0};
  if (::poll(&events, 1, kPatience) != 0) return;
  char first = 0;
  const ssize_t n = ::read(pipe, &first, 1);
  if (n == 0)
    throw FileError(path + ": a pipe that nothing writes to; expected a file, or a pipe with a writer");
  if (n == 1) text += first;
}

// --- Writing ---------------------------------------------------------------------------------------------

void write_all(int file, std::string_view text, const std::string& path) {
  while (!text.empty()) {
    const ssize_t n = ::write(file, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, "cannot write");
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

// The number of a descriptor of this process that the path stands for, as /dev/stdout and /dev/fd/3 do, or -1.
int own_descriptor(const fs::path& path) {
  std::error_code none;
  if (fs::canonical(path.parent_path(), none) != fs::canonical("/proc/self/fd", none) || none) return -1;
  const std::string name = path.filename().string();
  int number = -1;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  return error == std::errc() && end == name.data() + name.size() ? number : -1;
}

// Where links lead to; a place that is not there yet, or a descriptor's, is the end of the way.
fs::path followed(const std::string& path) {
  fs::path target(path);
  for (int links = 0; links < kMostLinks; ++links) {
    std::error_code error;
    if (own_descriptor(target) >= 0) return target;
    const fs::path next = fs::read_symlink(target, error);
    if (error) return target;
    target = target.parent_path() / next;  // an absolute `next` alone
  }
  throw FileError(path + ": cannot write: its links lead in a circle");
}

void write_through(const fs::path& target, std::string_view text, const std::string& path) {
  const Descriptor out{::open(target.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY)};
  if (out.number < 0) fail(path, "cannot open");
  write_all(out.number, text, path);
}

// Not every file system knows owners, and not everybody may give files away.
void take_over(int file, const struct stat& old, const std::string& path) {
  if (::fchown(file, old.st_uid, old.st_gid) != 0 && errno != EPERM && errno != EINVAL && errno != ENOSYS)
    fail(path, "cannot set its owner");
  if (::fchmod(file, old.st_mode & 0777) != 0) fail(path, "cannot set its permissions");
}

void replace(const fs::path& target, const struct stat* old, std::string_view text, const std::string& path) {
  const std::string temporary = temporary_name_beside(target.string());
  try {
    const Descriptor out{::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)};
    if (out.number < 0) fail(path, "cannot create");
    if (old) take_over(out.number, *old, path);
    write_all(out.number, text, path);
    if (::fsync(out.number) != 0) fail(path, "cannot flush to disk");
    if (::rename(temporary.c_str(), target.c_str()) != 0) fail(path, "cannot replace");
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
}

// The length in bytes of the character of UTF-8 that the text begins with, 0 if none does.
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  constexpr unsigned kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // of so many bytes; below, fewer would do
  const unsigned first = byte(0);
  const std::size_t n = first < 0x80 ? 1 : first < 0xC0 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (n < 2) return n;
  if (first >= 0xF8 || text.size() < n) return 0;
  unsigned code = first & (0xFFu >> (n + 1));
  for (std::size_t i = 1; i < n; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3Fu);
  }
  const bool is_half = code >= 0xD800 && code < 0xE000;  // of a pair of UTF-16
  return code < kLeast[n] || code > 0x10FFFF || is_half ? 0 : n;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t n = utf8_length(text);
    if (n == 0) return false;
    text.remove_prefix(n);
  }
  return true;
}

std::string temporary_stem(const fs::path& target) {
  return "." + target.stem().string().substr(0, 100) + ".";  // of the 255 bytes that a name may have
}

// 64 bits by Fowler, Noll and Vo.
std::string digest(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return std::to_string(hash);
}

// .STEM.MARK-DIGEST.tmp.EXTENSION
std::string temporary_name(const fs::path& target, const std::string& mark) {
  const std::string stem = temporary_stem(target), extension = target.extension().string().substr(0, 32);
  return stem + mark + "-" + digest(stem + mark + extension) + ".tmp" + extension;
}

void make_folder_of(const fs::path& target, const std::string& path) {
  std::error_code error;
  if (target.has_parent_path()) fs::create_directories(target.parent_path(), error);
  if (error) throw FileError(path + ": cannot make its folder: " + error.message());
}

}  // namespace

std::string read_file(const std::string& path) {
  if (path.empty()) throw FileError("cannot open a file without a name; expected a path, got \"\"");
  const Descriptor in{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK)};
  if (in.number < 0) fail(path, "cannot open");
  struct stat status {};
  if (::fstat(in.number, &status) != 0) fail(path, "cannot read");
  if (S_ISDIR(status.st_mode)) throw FileError(path + ": cannot read: it is a folder; expected a file");
  std::string text;
  if (S_ISFIFO(status.st_mode)) await_writer(in.number, text, path);
  ::fcntl(in.number, F_SETFL, 0);  // from now on, wait
  while (read_some(in.number, text, path)) continue;
  return text;
}

std::string temporary_name_beside(const std::string& path) {
  static std::atomic<unsigned> count{0};
  const std::string mark = std::to_string(::getpid()) + "-" + std::to_string(count++) + "-" +
                           std::to_string(std::random_device()());  // containers use numbers again
  return (fs::path(path).parent_path() / temporary_name(path, mark)).string();
}

bool is_temporary_name_beside(const std::string& path, const std::string& name) {
  const std::size_t begin = temporary_stem(path).size(), end = name.find_last_of('-');
  if (end == name.npos || end < begin) return false;
  return name == temporary_name(path, name.substr(begin, end - begin));
}

void check_can_write(const std::string& path) {
  if (path.empty()) throw FileError("cannot write a file without a name; expected a path, got \"\"");
  const fs::path target = followed(path);
  if (own_descriptor(target) >= 0) return;
  struct stat status {};
  const bool is_there = ::stat(target.c_str(), &status) == 0;
  if (is_there && S_ISDIR(status.st_mode))
    throw FileError(path + ": cannot write: it is a folder; expected the name of a file");
  if (path.ends_with('/'))
    throw FileError(path +
                    ": cannot write: the name ends like that of a folder; expected the name of a file");
  if (is_there && ::faccessat(AT_FDCWD, target.c_str(), W_OK, AT_EACCESS) != 0) fail(path, "cannot write");
}

void write_file_atomically(const std::string& path, std::string_view text) {
  check_can_write(path);
  const fs::path target = followed(path);
  if (const int descriptor = own_descriptor(target); descriptor >= 0)
    return write_all(descriptor, text, path);
  make_folder_of(target, path);
  struct stat status {};
  const bool is_there = ::stat(target.c_str(), &status) == 0;
  if (is_there && !S_ISREG(status.st_mode)) return write_through(target, text, path);
  replace(target, is_there ? &status : nullptr, text, path);
}

std::string fault_of_name(std::string_view name) {
  if (!is_utf8(name))
    return "is not UTF-8; expected a file in UTF-8 (from Latin-1: iconv -f latin1 -t utf-8)";
  const std::string text(name);
  if (one_line(text) != text) return "holds a line break or another control character; expected one line";
  return "";
}

}  // namespace dyntape
