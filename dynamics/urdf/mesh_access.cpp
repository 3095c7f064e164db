// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/mesh_access.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

#include <dyntape/autodiff/error.h>

namespace dyntape::dynamics {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostMeshBytes = std::size_t{1} << 28, kMostNamedBytes = std::size_t{1} << 24;

struct OpenFile {
  int number;
  ~OpenFile() {
    if (number >= 0) ::close(number);
  }
};

// Empty, with the reason, where it is no regular file or has more bytes; nothing is waited for.
std::optional<std::string> bytes_of_file(const std::string& path, std::size_t most, std::string& reason) {
  const OpenFile file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK)};
  struct stat status {};
  if (file.number < 0 || ::fstat(file.number, &status) != 0)
    return reason = std::string("cannot open: ") + std::strerror(errno), std::nullopt;
  if (!S_ISREG(status.st_mode)) return reason = "it is no regular file", std::nullopt;
  if (std::size_t(status.st_size) > most)
    return reason = "it has more than " + std::to_string(most >> 20) + " MiB", std::nullopt;
  std::string bytes(std::size_t(status.st_size), '\0');
  std::size_t have = 0;
  for (ssize_t got = 0; have < bytes.size(); have += std::size_t(got)) {
    got = ::read(file.number, bytes.data() + have, bytes.size() - have);
    if (got < 0 && errno == EINTR)
      got = 0;
    else if (got <= 0)
      break;
  }
  bytes.resize(have);
  return bytes;
}

// Of bytes in memory; its own, or those of somebody who stays longer.
class BytesStream : public Assimp::IOStream {
 public:
  explicit BytesStream(std::string own) : own_(std::move(own)), bytes_(own_) {}
  explicit BytesStream(std::string_view bytes) : bytes_(bytes) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    const std::size_t whole = size == 0 ? 0 : std::min(count, (bytes_.size() - at_) / size);
    std::memcpy(to, bytes_.data() + at_, whole * size);
    at_ += whole * size;
    return whole;
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const std::size_t from = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
    if (from + offset > bytes_.size()) return aiReturn_FAILURE;
    at_ = from + offset;
    return aiReturn_SUCCESS;
  }
  std::size_t Tell() const override { return at_; }
  std::size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::string own_;
  std::string_view bytes_;
  std::size_t at_ = 0;
};

MeshSize size_of_stl(std::string_view bytes) {
  constexpr std::size_t kHead = 84, kTriangle = 50;
  std::uint32_t count = 0;
  if (bytes.size() >= kHead) std::memcpy(&count, bytes.data() + kHead - sizeof count, sizeof count);
  if (bytes.size() >= kHead && bytes.size() == kHead + kTriangle * std::size_t(count))
    return {count, 9.0 * count};
  constexpr std::string_view kFacet = "endfacet";
  std::size_t facets = 0;
  for (std::size_t at = bytes.find(kFacet); at != bytes.npos; at = bytes.find(kFacet, at + kFacet.size()))
    ++facets;
  return {facets, 9.0 * double(facets)};
}

std::size_t words_in(std::string_view line) {
  std::size_t words = 0;
  bool in_word = false;
  for (const char c : line) {
    const bool is_blank = c == ' ' || c == '\t' || c == '\r';
    words += !is_blank && !in_word;
    in_word = !is_blank;
  }
  return words;
}

MeshSize size_of_obj(std::string_view bytes) {
  MeshSize size;
  std::size_t corners = 0;
  bool goes_on = false;  // a line that ends in a backslash
  while (!bytes.empty()) {
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
    if (!goes_on) {
      line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
      if (line.size() < 2 || line[0] != 'f' || (line[1] != ' ' && line[1] != '\t')) continue;
      line.remove_prefix(1);
      corners = 0;
    }
    if (line.ends_with('\r')) line.remove_suffix(1);
    goes_on = line.ends_with('\\');
    if (goes_on) line.remove_suffix(1);
    corners += words_in(line);
    if (goes_on && !bytes.empty()) continue;
    size.triangles += corners > 2 ? corners - 2 : 0;
    size.effort += double(corners) * double(corners);
  }
  return size;
}

}  // namespace

std::string mesh_bytes(const std::string& path) {
  std::string reason;
  std::optional<std::string> bytes = bytes_of_file(path, kMostMeshBytes, reason);
  if (!bytes) throw FileError(path + ": this mesh is left out: " + reason);
  return std::move(*bytes);
}

MeshSize size_of_mesh(const std::string& bytes, const std::string& extension) {
  if (extension == ".stl") return size_of_stl(bytes);
  return extension == ".obj" ? size_of_obj(bytes) : MeshSize{};
}

MeshAccess::MeshAccess(std::string path, const std::string& bytes, std::vector<fs::path> folders,
                       std::vector<std::string>& notes)
    : path_(std::move(path)), bytes_(bytes), notes_(notes) {
  for (const fs::path& folder : folders) {
    std::error_code none;
    if (const fs::path real = fs::canonical(folder, none); !none) folders_.push_back(real);
  }
}

bool MeshAccess::is_allowed(const std::string& file) const {
  std::error_code none;
  const fs::path real = fs::canonical(file, none);
  if (none || !fs::is_regular_file(real, none)) return false;
  return std::any_of(folders_.begin(), folders_.end(), [&](const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first == folder.end();
  });
}

bool MeshAccess::Exists(const char* file) const { return file == path_ || is_allowed(file); }

Assimp::IOStream* MeshAccess::Open(const char* file, const char* mode) {
  if (std::strpbrk(mode, "wa+")) return nullptr;
  if (file == path_) return new BytesStream(std::string_view(bytes_));
  std::error_code none;
  std::string reason = "it is no regular file below the folder of the mesh, the robot or its package";
  if (is_allowed(file)) {
    if (std::optional<std::string> bytes = bytes_of_file(file, kMostNamedBytes, reason))
      return new BytesStream(std::move(*bytes));
  }
  const std::string note = path_ + ": " + fs::path(file).lexically_normal().string() +
                           ", which this mesh names, is left out: " + reason;
  const bool is_there = fs::exists(fs::symlink_status(file, none));
  if (is_there && std::find(notes_.begin(), notes_.end(), note) == notes_.end()) notes_.push_back(note);
  return nullptr;
}

}  // namespace dyntape::dynamics
