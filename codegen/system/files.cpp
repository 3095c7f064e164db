// SPDX-License-Identifier: BSD-3-Clause
#define XXH_INLINE_ALL
#include <dyntape/codegen/system/files.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#if defined(__SSE2__)
#define XXH_VECTOR XXH_SSE2  // gcc 12 warns about its own AVX-512 header
#endif
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/owners.h>
#include <dyntape/codegen/system/warn_once.h>

namespace dyntape::codegen {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw FileError(path + ": " + what + ": " + std::strerror(error));
}

constexpr std::int64_t kDay = 24 * 3600;

std::atomic<int> temporary_folders = 0;  // of this process

// Waits for nobody: neither for the writer of a FIFO nor for a device.
constexpr int kToRead = O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;

std::uint64_t random_number() {
  std::uint64_t number = 0;
  if (getrandom(&number, sizeof number, 0) != sizeof number) {
    static std::atomic<std::uint64_t> next{0};
    number = next++;
  }
  return number;
}

// "" if the folder can be used for files that are run.
std::string fault_of_temporary(const std::string& folder) {
  std::error_code error;
  const std::filesystem::path resolved = std::filesystem::canonical(folder, error);
  if (error) return folder + ": " + error.message();
  if (access(resolved.c_str(), W_OK | X_OK) != 0) return folder + ": " + std::strerror(errno);
  return exchangeable(resolved.string());
}

// The mark appears locked: whoever finds it free knows that its process has ended.
Descriptor locked_mark(const std::string& folder) {
  const std::string mark = folder + "/" + kMark, draft = mark + "-new";
  Descriptor file(open(draft.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (file.number() < 0) fail(folder, "cannot be marked", errno);
  (void)flock(file.number(), LOCK_EX | LOCK_NB);
  if (std::rename(draft.c_str(), mark.c_str()) != 0) fail(folder, "cannot be marked", errno);
  return file;
}

}  // namespace

void write_all(int file, const std::string& path, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(path, "cannot be written", written < 0 ? errno : ENOSPC);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void write_file(const std::string& path, std::string_view text) {
  Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (file.number() < 0) fail(path, "cannot be written", errno);
  write_all(file.number(), path, text);
  if (!file.close()) fail(path, "cannot be written", errno);
}

std::optional<std::string> read_file(const std::string& path, int& error, std::uint64_t most) {
  const Descriptor file(open(path.c_str(), kToRead));
  if (file.number() >= 0) return read_file(file.number(), error, most);
  error = errno;
  return std::nullopt;
}

std::optional<std::string> read_file(int file, int& error, std::uint64_t most) {
  error = 0;
  struct stat status {};
  if (fstat(file, &status) != 0) return error = errno, std::nullopt;
  if (!S_ISREG(status.st_mode)) return error = EINVAL, std::nullopt;
  if (static_cast<std::uint64_t>(status.st_size) > most) return error = EFBIG, std::nullopt;
  std::string text(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t have = 0;
  while (have < text.size()) {
    const ssize_t got = read(file, text.data() + have, text.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return error = errno, std::nullopt;
    if (got == 0) break;
    have += static_cast<std::size_t>(got);
  }
  text.resize(have);
  return text;
}

std::vector<std::string> names_in(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> names;
  std::error_code error;
  for (auto it = fs::directory_iterator(folder, error); !error && it != fs::directory_iterator();
       it.increment(error))
    names.push_back(it->path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::int64_t modified(const std::string& path) {
  struct stat status {};
  return lstat(path.c_str(), &status) == 0 ? status.st_mtim.tv_sec : 0;
}

std::string checksum(std::string_view text) {
  const XXH128_hash_t h = XXH3_128bits(text.data(), text.size());
  char digits[33];
  std::snprintf(digits, sizeof digits, "%016llx%016llx", static_cast<unsigned long long>(h.high64),
                static_cast<unsigned long long>(h.low64));
  return digits;
}

std::string system_temporary_folder() {
  const char* wanted = std::getenv("TMPDIR");
  std::string faults;
  for (const std::string folder : {wanted ? wanted : "", "/tmp"}) {
    if (folder.empty()) continue;
    const std::string fault = fault_of_temporary(folder);
    if (!fault.empty()) faults += (faults.empty() ? "" : "; ") + fault;
    if (fault.empty() && !faults.empty()) warn_once("TMPDIR is not used, " + folder + " is: " + faults);
    if (fault.empty()) return folder;
  }
  throw FileError("there is no folder for temporary files: " + faults);
}

std::string name_of_its_own(const std::string& prefix) {
  char number[17];
  std::snprintf(number, sizeof number, "%016llx", static_cast<unsigned long long>(random_number()));
  return prefix + std::to_string(getpid()) + "-" + number;
}

TemporaryFolder::Counted::Counted() { ++temporary_folders; }
TemporaryFolder::Counted::~Counted() { --temporary_folders; }
bool TemporaryFolder::any() { return temporary_folders > 0; }

TemporaryFolder::TemporaryFolder(const std::string& parent, const std::string& prefix) {
  std::string path;
  do {
    path = parent + "/" + name_of_its_own(prefix);
    if (mkdir(path.c_str(), 0700) == 0) path_ = path;
  } while (path_.empty() && errno == EEXIST);
  if (path_.empty()) fail(path, "cannot be made", errno);
  try {
    mark_ = locked_mark(path_);
  } catch (const FileError&) {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
    throw;
  }
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

void TemporaryFolder::release() {
  path_.clear();
  mark_ = Descriptor();
}

void TemporaryFolder::keep() {
  (void)!write(mark_.number(), "kept\n", 5);  // where it cannot be said it goes earlier
  release();
}

Left state_of(const std::string& folder) {
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != geteuid())
    return Left::kNotOurs;
  const Descriptor mark(open((folder + "/" + kMark).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (mark.number() < 0 || fstat(mark.number(), &status) != 0 || !S_ISREG(status.st_mode))
    return Left::kNotOurs;
  if (status.st_uid != geteuid()) return Left::kNotOurs;
  if (flock(mark.number(), LOCK_EX | LOCK_NB) != 0) return Left::kInUse;
  const bool is_kept = status.st_size > 0 && std::time(nullptr) - status.st_mtim.tv_sec < kDay;
  return is_kept ? Left::kKept : Left::kOver;
}

void remove_left_over(const std::string& parent, const std::string& prefix) {
  for (const std::string& name : names_in(parent)) {
    std::error_code ignored;
    const std::string path = parent + "/" + name;
    if (name.starts_with(prefix) && state_of(path) == Left::kOver) std::filesystem::remove_all(path, ignored);
  }
}

std::string environment_variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

}  // namespace dyntape::codegen
