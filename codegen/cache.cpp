// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/cache.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/cache_folder.h>
#include <dyntape/codegen/notice.h>

namespace dyntape::codegen {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kHour = 3600, kDay = 24 * kHour;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

bool is_digest(const std::string& name) {
  return name.size() == 32 && name.find_first_not_of("0123456789abcdef") == std::string::npos;
}

// Names of what a folder holds; empty if it cannot be read.
std::vector<std::string> names_in(const std::string& folder) {
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
  return lstat(path.c_str(), &status) == 0 ? status.st_mtim.tv_sec : std::time(nullptr);
}

// Nobody is to see an entry that is half gone: it is renamed first.
bool remove_entry(const std::string& root, const std::string& entry) {
  try {
    TemporaryFolder trash(root, "build-");
    return std::rename(entry.c_str(), (trash.path() + "/entry").c_str()) == 0;
  } catch (const FileError&) {
    return false;
  }
}

}  // namespace

Key make_key(std::string text) {
  std::string digest = checksum(text);
  return {std::move(text), std::move(digest)};
}

std::string Cache::usual_folder() {
  if (const std::string folder = environment("DYNTAPE_CACHE"); !folder.empty()) return folder;
  if (const std::string folder = environment("XDG_CACHE_HOME"); folder.starts_with('/'))
    return folder + "/dyntape";
  if (const std::string folder = environment("HOME"); !folder.empty()) return folder + "/.cache/dyntape";
  return {};
}

std::optional<Cache> Cache::open(const std::string& folder) {
  const std::string wanted = folder.empty() ? usual_folder() : folder;
  std::string reason = "neither DYNTAPE_CACHE, XDG_CACHE_HOME nor HOME is set";
  const std::string path = wanted.empty() ? "" : private_folder(wanted, reason);
  if (!path.empty()) return Cache(path);
  say_once("compiled derivatives are not kept: " + reason);
  return std::nullopt;
}

std::optional<Entry> Cache::find(const Key& key) const {
  Entry entry;
  const Verdict verdict = check_entry(folder_of(key.digest), key.digest, entry);
  switch (verdict.fault) {
    case Fault::kNone:
      // The time of last use, for the sweep.  Where it cannot be noted nothing is lost.
      (void)utimensat(AT_FDCWD, (entry.folder + "/manifest.json").c_str(), nullptr, 0);
      return entry;
    case Fault::kContent:
      say_once("a library in the cache is compiled again: " + verdict.reason);
      remove_entry(folder_, folder_of(key.digest));
      break;
    case Fault::kRefused:
    case Fault::kInputOutput:
      say_once("an entry of the cache is not used: " + verdict.reason);
      break;
    case Fault::kMissing:
      break;
  }
  return std::nullopt;
}

std::optional<Entry> Cache::publish(TemporaryFolder& built, const Key& key, const Manifest& manifest,
                                    bool replace) const {
  const std::string entry = folder_of(key.digest);
  try {
    int error = 0;
    const auto library = read_file(built.path() + "/library.so", error);
    const auto source = read_file(built.path() + "/source.c", error);
    if (!library || !source) throw FileError(built.path() + ": " + std::strerror(error));
    write_file(built.path() + "/manifest.json", manifest_text(key, manifest, *library, *source));
    for (const std::string& name : names_in(built.path())) {
      if (name != "library.so" && name != "source.c" && name != "manifest.json")
        fs::remove_all(built.path() + "/" + name);
    }
    if (chmod((built.path() + "/library.so").c_str(), 0600) != 0) throw FileError(std::strerror(errno));
    for (int tries = 0; std::rename(built.path().c_str(), entry.c_str()) != 0; ++tries) {
      if ((errno != ENOTEMPTY && errno != EEXIST && errno != ENOTDIR) || tries == 3)
        throw FileError(entry + ": " + std::strerror(errno));
      if (auto theirs = replace ? std::nullopt : find(key)) return theirs;
      if (!remove_entry(folder_, entry) && errno != ENOENT)
        throw FileError(entry + ": " + std::strerror(errno));
    }
    built.release();
  } catch (const std::exception& e) {
    say_once("a compiled library is not kept: " + std::string(e.what()));
    return std::nullopt;
  }
  return find(key);
}

void Cache::remove(const Key& key) const { remove_entry(folder_, folder_of(key.digest)); }

std::vector<Entry> Cache::list() const {
  std::vector<Entry> entries;
  for (const std::string& name : names_in(folder_)) {
    if (!is_digest(name)) continue;
    Entry entry;
    entry.folder = folder_of(name);
    check_entry(entry.folder, name, entry);
    entries.push_back(entry);
  }
  return entries;
}

Verdict Cache::verify(const std::string& digest) const {
  Entry entry;
  const Verdict verdict = check_entry(folder_of(digest), digest, entry);
  if (verdict.fault != Fault::kNone) return verdict;
  int error = 0;
  const auto source = read_file(entry.source(), error);
  if (!source) return {Fault::kContent, entry.source() + " cannot be read: " + std::strerror(error)};
  if (checksum(*source) != entry.manifest.text_hash)
    return {Fault::kContent, entry.source() + " is not the text that was compiled"};
  return {};
}

std::size_t Cache::clear() const {
  std::size_t removed = 0;
  for (const std::string& name : names_in(folder_)) {
    const std::string path = folder_ + "/" + name;
    if (is_digest(name)) removed += remove_entry(folder_, path);
    // Work of processes that were ended; one that is at work now is younger.
    std::error_code ignored;
    const bool left_over = name.starts_with("build-") && std::time(nullptr) - modified(path) > kHour;
    if (left_over || (name.starts_with("compiler-") && name.ends_with(".json")))
      fs::remove_all(path, ignored);
  }
  return removed;
}

std::size_t Cache::sweep(std::uint64_t limit) const {
  for (const std::string& name : names_in(folder_)) {
    std::error_code ignored;
    const std::string path = folder_ + "/" + name;
    if (name.starts_with("build-") && std::time(nullptr) - modified(path) > kDay)
      fs::remove_all(path, ignored);
  }
  std::vector<Entry> entries = list();
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.last_used < b.last_used; });
  std::uint64_t total = 0;
  for (const Entry& entry : entries) total += entry.bytes;
  std::size_t removed = 0;
  for (const Entry& entry : entries) {
    if (total <= limit) break;
    if (!remove_entry(folder_, entry.folder)) continue;
    total -= entry.bytes;
    ++removed;
  }
  return removed;
}

void Cache::sweep_sometimes() const {
  const std::string stamp = folder_ + "/last-sweep";
  struct stat status {};
  if (stat(stamp.c_str(), &status) == 0 && std::time(nullptr) - status.st_mtim.tv_sec < kHour) return;
  const int file = ::open(stamp.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file < 0) return;
  if (flock(file, LOCK_EX | LOCK_NB) == 0) {  // otherwise another process is sweeping
    (void)futimens(file, nullptr);
    try {
      sweep(cache_limit());
    } catch (const ArgumentError& e) {
      say_once(e.what());
    }
  }
  close(file);
}

std::uint64_t cache_limit() {
  constexpr std::uint64_t kDefault = std::uint64_t{2} << 30;
  const std::string text = environment("DYNTAPE_CACHE_LIMIT");
  if (text.empty()) return kDefault;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  const int shift = unit.empty() ? 0 : unit == "K" ? 10 : unit == "M" ? 20 : unit == "G" ? 30 : -1;
  if (error != std::errc() || shift < 0 || (shift && value >> (64 - shift)))
    throw ArgumentError("DYNTAPE_CACHE_LIMIT is \"" + text +
                        "\"; a number of bytes was expected, as in 500M");
  return value << shift;
}

}  // namespace dyntape::codegen
