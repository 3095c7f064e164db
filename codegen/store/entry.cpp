// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/store/entry.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/owners.h>

namespace dyntape::codegen {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kSchema = 1;
constexpr const char* kFiles[] = {"library.so", "manifest.json", "source.c"};  // sorted

Verdict io_fault(const std::string& path, int error) {
  return {Fault::kInputOutput, path + ": " + std::strerror(error)};
}
Verdict content_fault(const std::string& what) { return {Fault::kContent, what}; }

// A missing file is wrong content of the entry; anything else that keeps us from reading it is not.
Verdict unread(const std::string& path, int error) {
  if (error == ENOENT || error == ELOOP || error == EINVAL)
    return content_fault(path + " is missing or no regular file");
  return io_fault(path, error);
}

template <class T>
T get(const Json& json, const char* name, T otherwise) {
  const auto found = json.find(name);
  try {
    return found == json.end() ? otherwise : found->get<T>();
  } catch (const Json::exception&) {
    return otherwise;
  }
}

// A file of an entry, opened, checked and read once.
Verdict read_ours(const Descriptor& folder, const std::string& path, std::uint64_t most, std::string& text) {
  const std::string name = path.substr(path.rfind('/') + 1);
  const Descriptor file(
      openat(folder.number(), name.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (file.number() < 0) return unread(path, errno);
  int error = 0;
  auto found = read_file(file.number(), error, most);
  if (!found && error == EFBIG) return content_fault(path + " has more bytes than it should");
  if (!found) return unread(path, error);
  if (std::string reason = shared_with_others(file.number(), path); !reason.empty())
    return {Fault::kRefused, reason};
  text = std::move(*found);
  return {};
}

Verdict check_library(const Descriptor& folder, const Json& manifest, const Entry& entry,
                      std::string* library) {
  const auto bytes = get<std::uint64_t>(manifest, "library_bytes", 0);
  const auto wrong_size = [&](std::uint64_t size) {
    return content_fault(entry.library() + " has " + std::to_string(size) + " bytes, the manifest says " +
                         std::to_string(bytes));
  };
  struct stat status {};
  if (fstatat(folder.number(), "library.so", &status, AT_SYMLINK_NOFOLLOW) != 0)
    return unread(entry.library(), errno);
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (S_ISREG(status.st_mode) && size != bytes) return wrong_size(size);
  if (!library) return {};
  const Verdict verdict = read_ours(folder, entry.library(), bytes, *library);
  if (verdict.fault != Fault::kNone) return verdict;
  if (library->size() != bytes) return wrong_size(library->size());
  if (checksum(*library) != get<std::string>(manifest, "library_checksum", ""))
    return content_fault(entry.library() + " does not have the checksum of its manifest");
  return {};
}

bool is_manifest_of(const Json& json, const std::string& digest) {
  return json.is_object() && get<int>(json, "schema", 0) == kSchema &&
         get<std::string>(json, "key", "") == digest &&
         make_key(get<std::string>(json, "key_text", "")).digest == digest;
}

constexpr std::uint64_t kLongestManifest = 1 << 20;

Json manifest_in(const Descriptor& folder, const std::string& path, Verdict& verdict) {
  std::string text;
  verdict = read_ours(folder, path, kLongestManifest, text);
  return Json::parse(text, nullptr, false);
}

Descriptor opened(const std::string& folder) {
  return Descriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

// Bytes on the disk, and the time of last use: that of the manifest.
void weigh(const Descriptor& folder, Entry& entry) {
  struct stat status {};
  for (const std::string name : kFiles) {
    if (fstatat(folder.number(), name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0) continue;
    entry.bytes += static_cast<std::uint64_t>(status.st_size);
    if (name == "manifest.json") entry.last_used = status.st_mtim.tv_sec;
  }
}

// With all above it, for nobody else.  False: errno says why not.
bool make_folder(const fs::path& path) {
  std::error_code error;
  const bool has_parent = !path.has_relative_path() || fs::exists(path.parent_path(), error);
  if (!has_parent && !make_folder(path.parent_path())) return false;
  return mkdir(path.c_str(), 0700) == 0 || errno == EEXIST;
}

// Of a shared folder the private one in it, made if need be.
std::string own_folder_in(const std::string& shared) {
  const std::string path = shared + "/user-" + std::to_string(geteuid());
  (void)mkdir(path.c_str(), 0700);
  return path;
}

std::string fault_of_private(const std::string& path) {
  const Descriptor folder = opened(path);
  if (folder.number() < 0) return path + ": " + std::strerror(errno);
  return shared_with_others(folder.number(), path);
}

Manifest read_manifest(const Json& json) {
  return {get<std::string>(json, "name", ""), get<int>(json, "order", 0),
          get<std::string>(json, "generator", ""), get<std::string>(json, "compiler", ""),
          get<std::string>(json, "text_hash", "")};
}

}  // namespace

Key make_key(std::string text) {
  std::string digest = checksum(text);
  return {std::move(text), std::move(digest)};
}

bool is_digest(const std::string& name) {
  return name.size() == 32 && name.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::string private_folder(const std::string& wanted, std::string& reason) {
  std::error_code error;
  const fs::path absolute = fs::absolute(wanted, error);
  if (error) return reason = wanted + ": " + error.message(), "";
  std::string path = absolute.lexically_normal().string();
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  if (!fs::exists(path, error) && !make_folder(path)) return reason = path + ": " + std::strerror(errno), "";
  // A link to a folder (to another disk) is the user's choice: what it leads to is judged.
  const fs::path resolved = fs::canonical(path, error);
  if (error) return reason = path + ": " + error.message(), "";
  path = resolved.string();
  if (!fs::is_directory(path, error)) return reason = path + " is no folder", "";
  if (!fault_of_private(path).empty()) path = own_folder_in(path);
  reason = exchangeable(path.substr(0, path.rfind('/')));
  if (reason.empty()) reason = fault_of_private(path);
  return reason.empty() ? path : "";
}

Verdict check_entry(const std::string& path, const std::string& digest, Entry& entry, std::string* library) {
  const Descriptor folder = opened(path);
  if (folder.number() < 0 && errno == ENOENT) return {Fault::kMissing, path + " does not exist"};
  if (folder.number() < 0 && (errno == ENOTDIR || errno == ELOOP))
    return content_fault(path + " is no folder");
  if (folder.number() < 0) return io_fault(path, errno);
  if (std::string reason = shared_with_others(folder.number(), path); !reason.empty())
    return {Fault::kRefused, reason};

  entry.folder = path;
  weigh(folder, entry);
  Verdict verdict;
  const Json json = manifest_in(folder, path + "/manifest.json", verdict);
  if (verdict.fault != Fault::kNone) return verdict;
  if (!is_manifest_of(json, digest))
    return content_fault(path + "/manifest.json is no manifest of this entry");
  entry.manifest = read_manifest(json);
  return check_library(folder, json, entry, library);
}

bool is_entry(const std::string& path) {
  const std::string name = path.substr(path.rfind('/') + 1);
  if (!is_digest(name)) return false;
  const Descriptor folder = opened(path);
  if (folder.number() < 0) return false;
  if (names_in(path) == std::vector<std::string>(std::begin(kFiles), std::end(kFiles))) return true;
  Verdict verdict;
  return is_manifest_of(manifest_in(folder, path + "/manifest.json", verdict), name);
}

std::string manifest_text(const Key& key, const Manifest& manifest, const std::string& library,
                          const std::string& source) {
  return Json{{"schema", kSchema},
              {"key", key.digest},
              {"key_text", key.text},
              {"name", manifest.name},
              {"order", manifest.order},
              {"generator", manifest.generator},
              {"compiler", manifest.compiler},
              {"text_hash", manifest.text_hash},
              {"library_bytes", library.size()},
              {"library_checksum", checksum(library)},
              {"source_bytes", source.size()}}
             .dump(1, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

}  // namespace dyntape::codegen
