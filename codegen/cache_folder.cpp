// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/cache_folder.h>

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

namespace dyntape::codegen {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kSchema = 1;

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

Verdict check_library(const std::string& path, const Json& manifest, Entry& entry) {
  int error = 0;
  const auto library = read_file(path, error);
  if (!library) return unread(path, error);
  if (library->size() != get<std::uint64_t>(manifest, "library_bytes", 0))
    return content_fault(path + " has " + std::to_string(library->size()) + " bytes, the manifest says " +
                         std::to_string(get<std::uint64_t>(manifest, "library_bytes", 0)));
  if (checksum(*library) != get<std::string>(manifest, "library_checksum", ""))
    return content_fault(path + " does not have the checksum of its manifest");
  entry.bytes += library->size();
  return {};
}

}  // namespace

bool is_ours_alone(const std::string& path, bool folder, std::string& reason) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) {
    reason = path + ": " + std::strerror(errno);
    return false;
  }
  if (folder ? !S_ISDIR(status.st_mode) : !S_ISREG(status.st_mode)) {
    reason = path + (folder ? " is no folder" : " is no regular file");
  } else if (status.st_uid != geteuid()) {
    reason = path + " belongs to user " + std::to_string(status.st_uid) + ", not to this one";
  } else if (status.st_mode & (S_IWGRP | S_IWOTH)) {
    reason = path + " may be written by others";
  } else {
    return true;
  }
  return false;
}

std::string private_folder(const std::string& wanted, std::string& reason) {
  std::error_code error;
  const fs::path absolute = fs::absolute(wanted, error);
  if (error) return reason = wanted + ": " + error.message(), "";
  std::string path = absolute.lexically_normal().string();
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  if (!fs::exists(path, error)) {
    fs::create_directories(fs::path(path).parent_path(), error);
    if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
      return reason = path + ": " + std::strerror(errno), "";
  }
  // A link to a folder (to another disk) is the user's choice: what it leads to is judged.
  const fs::path resolved = fs::canonical(path, error);
  if (error) return reason = path + ": " + error.message(), "";
  path = resolved.string();
  if (!fs::is_directory(path, error)) return reason = path + " is no folder", "";
  if (!is_ours_alone(path, true, reason)) {
    path += "/user-" + std::to_string(geteuid());
    if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
      return reason = path + ": " + std::strerror(errno), "";
    if (!is_ours_alone(path, true, reason)) return "";
  }
  return path;
}

Verdict check_entry(const std::string& folder, const std::string& digest, Entry& entry) {
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0)
    return errno == ENOENT ? Verdict{Fault::kMissing, folder + " does not exist"} : io_fault(folder, errno);
  Verdict refused{Fault::kRefused, ""};
  if (status.st_uid == geteuid() && !S_ISDIR(status.st_mode)) return content_fault(folder + " is no folder");
  if (!is_ours_alone(folder, true, refused.reason)) return refused;

  entry.folder = folder;
  const std::string manifest_path = folder + "/manifest.json";
  int error = 0;
  const auto text = read_file(manifest_path, error);
  if (!text) return unread(manifest_path, error);
  const Json json = Json::parse(*text, nullptr, false);
  if (!json.is_object() || get<int>(json, "schema", 0) != kSchema ||
      get<std::string>(json, "key", "") != digest ||
      make_key(get<std::string>(json, "key_text", "")).digest != digest)
    return content_fault(manifest_path + " is no manifest of this entry");
  for (const char* file : {"manifest.json", "library.so"}) {
    const std::string path = folder + "/" + file;
    if (lstat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
        !is_ours_alone(path, false, refused.reason))
      return refused;
  }
  entry.manifest = {get<std::string>(json, "name", ""),     get<int>(json, "order", 0),
                    get<std::string>(json, "profile", ""),  get<std::string>(json, "generator", ""),
                    get<std::string>(json, "compiler", ""), get<std::string>(json, "text_hash", "")};
  entry.bytes = text->size() + get<std::uint64_t>(json, "source_bytes", 0);
  if (stat(manifest_path.c_str(), &status) == 0) entry.last_used = status.st_mtim.tv_sec;
  return check_library(entry.library(), json, entry);
}

std::string manifest_text(const Key& key, const Manifest& manifest, const std::string& library,
                          const std::string& source) {
  return Json{{"schema", kSchema},
              {"key", key.digest},
              {"key_text", key.text},
              {"name", manifest.name},
              {"order", manifest.order},
              {"profile", manifest.profile},
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
