// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/store/cache.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/warn_once.h>

namespace dyntape::codegen {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kHour = 3600;

// Folders in which something is compiled, here and in the folder for temporary files (library_builder.cpp).
constexpr char kBuild[] = "build-", kElsewhere[] = "dyntape-";
constexpr char kRemoved[] = "removed-";

// Nobody is to see an entry that is half gone: it is renamed first.  Why it cannot be removed, or "".
std::string remove_entry(const std::string& root, const std::string& entry) {
  const std::string trash = root + "/" + name_of_its_own(kRemoved);
  std::error_code error;
  if (std::rename(entry.c_str(), trash.c_str()) != 0)
    return entry + " cannot be removed: " + std::strerror(errno);
  fs::remove_all(trash, error);
  return error ? trash + " cannot be removed: " + error.message() : "";
}

// What remove_entry() leaves when its process is killed half-way: removed-<process>-<16 digits>.
bool is_half_removed(const std::string& name) {
  const std::size_t process = sizeof kRemoved - 1, dash = name.find('-', process);
  return name.starts_with(kRemoved) && dash != std::string::npos && dash > process &&
         name.size() - dash == 17 && name.find_first_not_of("0123456789", process) >= dash &&
         name.find_first_not_of("0123456789abcdef", dash + 1) == std::string::npos;
}

// A remembered compiler (identity.h).
bool is_record(const std::string& name) {
  return name.starts_with("compiler-") && name.ends_with(".json") &&
         is_digest(name.substr(9, name.size() - 14));
}

std::uint64_t bytes_of(const std::string& folder) {
  std::uint64_t bytes = 0;
  struct stat status {};
  for (const std::string& name : names_in(folder)) {
    if (lstat((folder + "/" + name).c_str(), &status) == 0)
      bytes += static_cast<std::uint64_t>(status.st_size);
  }
  return bytes;
}

// Library and source get their manifest; nothing else is left beside them.
void complete(const std::string& folder, const Key& key, const Manifest& manifest) {
  int error = 0;
  const auto library = read_file(folder + "/library.so", error);
  const auto source = read_file(folder + "/source.c", error);
  if (!library || !source) throw FileError(folder + ": " + std::strerror(error));
  write_file(folder + "/manifest.json", manifest_text(key, manifest, *library, *source));
  for (const std::string& name : names_in(folder)) {
    if (name != "library.so" && name != "source.c" && name != "manifest.json" && name != kMark)
      fs::remove_all(folder + "/" + name);
  }
  if (chmod((folder + "/library.so").c_str(), 0600) != 0) throw FileError(std::strerror(errno));
}

}  // namespace

std::string Cache::usual_folder() {
  if (const std::string folder = environment_variable("DYNTAPE_CACHE"); !folder.empty()) return folder;
  if (const std::string folder = environment_variable("XDG_CACHE_HOME"); folder.starts_with('/'))
    return folder + "/dyntape";
  if (const std::string folder = environment_variable("HOME"); !folder.empty())
    return folder + "/.cache/dyntape";
  return {};
}

std::optional<Cache> Cache::open(const std::string& folder) {
  const std::string wanted = folder.empty() ? usual_folder() : folder;
  std::string reason = "neither DYNTAPE_CACHE, XDG_CACHE_HOME nor HOME is set";
  const std::string path = wanted.empty() ? "" : private_folder(wanted, reason);
  if (!path.empty()) return Cache(path);
  warn_once("compiled derivatives are not kept: " + reason);
  return std::nullopt;
}

std::optional<Entry> Cache::find(const Key& key) const {
  Entry entry;
  const Verdict verdict = check_entry(folder_of(key.digest), key.digest, entry, &entry.image);
  switch (verdict.fault) {
    case Fault::kNone:
      // The time of last use, for the sweep.  Where it cannot be noted nothing is lost.
      (void)utimensat(AT_FDCWD, (entry.folder + "/manifest.json").c_str(), nullptr, 0);
      return entry;
    case Fault::kContent:
      warn_once("a library in the cache is compiled again: " + verdict.reason);
      remove(key);
      break;
    case Fault::kRefused:
    case Fault::kInputOutput:
      warn_once("an entry of the cache is not used: " + verdict.reason);
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
    complete(built.path(), key, manifest);
    for (int tries = 0; std::rename(built.path().c_str(), entry.c_str()) != 0; ++tries) {
      if ((errno != ENOTEMPTY && errno != EEXIST && errno != ENOTDIR) || tries == 3)
        throw FileError(entry + ": " + std::strerror(errno));
      if (auto theirs = replace ? std::nullopt : find(key)) return theirs;
      remove(key);
    }
    built.release();
    unlink((entry + "/" + kMark).c_str());
  } catch (const std::exception& e) {
    warn_once("a compiled library is not kept: " + std::string(e.what()));
    return std::nullopt;
  }
  return find(key);
}

void Cache::remove(const Key& key) const { remove_entry(folder_, folder_of(key.digest)); }

std::vector<std::string> Cache::entries() const {
  std::vector<std::string> folders;
  for (const std::string& name : names_in(folder_)) {
    if (is_entry(folder_of(name))) folders.push_back(folder_of(name));
  }
  return folders;
}

std::vector<Entry> Cache::list() const {
  std::vector<Entry> entries;
  for (const std::string& folder : this->entries()) {
    Entry entry;
    entry.folder = folder;
    check_entry(folder, fs::path(folder).filename(), entry);
    entries.push_back(entry);
  }
  return entries;
}

Verdict Cache::verify(const std::string& digest) const {
  Entry entry;
  const Verdict verdict = check_entry(folder_of(digest), digest, entry, &entry.image);
  if (verdict.fault != Fault::kNone) return verdict;
  int error = 0;
  const auto source = read_file(entry.source(), error);
  if (!source) return {Fault::kContent, entry.source() + " cannot be read: " + std::strerror(error)};
  if (checksum(*source) != entry.manifest.text_hash)
    return {Fault::kContent, entry.source() + " is not the text that was compiled"};
  return {};
}

std::vector<LeftOver> Cache::left_over() const {
  std::vector<LeftOver> found;
  const auto look = [&](const std::string& parent, const std::string& prefix, bool only_over) {
    for (const std::string& name : names_in(parent)) {
      const std::string folder = parent + "/" + name;
      const Left state = name.starts_with(prefix) ? state_of(folder) : Left::kNotOurs;
      if (state != Left::kNotOurs && (state == Left::kOver || !only_over))
        found.push_back({folder, state, bytes_of(folder), modified(folder)});
    }
  };
  look(folder_, kBuild, false);
  try {
    look(system_temporary_folder(), kElsewhere, true);  // the others may be of another store
  } catch (const FileError&) {                          // there is none, and nothing in it
  }
  return found;
}

std::size_t Cache::clear() const {
  std::size_t removed = 0;
  std::string trouble;
  for (const std::string& folder : entries()) {
    const std::string reason = remove_entry(folder_, folder);
    removed += reason.empty();
    if (!reason.empty()) trouble = reason;
  }
  for (const std::string& name : names_in(folder_)) {
    std::error_code ignored;
    if (is_record(name)) fs::remove(folder_of(name), ignored);
  }
  for (const LeftOver& left : left_over()) {
    std::error_code ignored;
    if (left.state != Left::kInUse) fs::remove_all(left.folder, ignored);
  }
  remove_left_over();
  if (!trouble.empty()) throw FileError(trouble);
  return removed;
}

void Cache::remove_left_over() const {
  codegen::remove_left_over(folder_, kBuild);
  for (const std::string& name : names_in(folder_)) {
    std::error_code ignored;
    if (is_half_removed(name)) fs::remove_all(folder_of(name), ignored);
  }
}

std::size_t Cache::sweep(std::uint64_t limit) const {
  remove_left_over();
  struct Stored {
    std::string folder;
    std::uint64_t bytes;
    std::int64_t last_used;
  };
  std::vector<Stored> all;
  std::uint64_t total = 0;
  const auto add = [&](const std::string& folder, std::int64_t last_used) {
    all.push_back({folder, bytes_of(folder), last_used});
    total += all.back().bytes;
  };
  for (const std::string& folder : entries()) add(folder, modified(folder + "/manifest.json"));
  for (const std::string& name : names_in(folder_)) {  // sources that a person was told of
    if (name.starts_with(kBuild) && state_of(folder_of(name)) == Left::kKept)
      add(folder_of(name), modified(folder_of(name)));
  }
  std::sort(all.begin(), all.end(),
            [](const Stored& a, const Stored& b) { return a.last_used < b.last_used; });
  std::size_t removed = 0;
  for (const Stored& stored : all) {
    if (total <= limit) break;
    if (!remove_entry(folder_, stored.folder).empty()) continue;
    total -= stored.bytes;
    ++removed;
  }
  return removed;
}

void Cache::sweep_sometimes() const {
  const std::string stamp = folder_ + "/last-sweep";
  const std::int64_t age = std::time(nullptr) - modified(stamp);
  if (age >= 0 && age < kHour) return;  // a time to come is nonsense, and counts as none
  Descriptor file(::open(stamp.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600));
  if (file.number() < 0 || flock(file.number(), LOCK_EX | LOCK_NB) != 0)
    return;  // another process is sweeping
  (void)futimens(file.number(), nullptr);
  try {
    codegen::remove_left_over(system_temporary_folder(), kElsewhere);
    sweep(cache_limit());
  } catch (const Error& e) {
    warn_once(e.what());
  }
}

std::uint64_t cache_limit() {
  constexpr std::uint64_t kDefault = std::uint64_t{2} << 30;
  const std::string text = environment_variable("DYNTAPE_CACHE_LIMIT");
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
