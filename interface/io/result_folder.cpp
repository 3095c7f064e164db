// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/result_folder.h>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::io {

namespace {

namespace fs = std::filesystem;

constexpr const char *kList = ".dyntape-results", *kBegun = "begun", *kGone = "gone";
constexpr const char* kHead =
    "; Files of this folder that dyntape has written, and may replace: checksum, name.\n";
constexpr std::size_t kLong = 1 << 14;  // bytes of a list that is written anew

// Zeros and all; of a link, what it leads to.
std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool is_plain(const std::string& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}

std::map<std::string, std::string> entries_of(const std::string& list) {
  std::map<std::string, std::string> entries;
  std::istringstream lines(list.substr(std::strlen(kHead)));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t blank = line.find(' ');
    if (blank == line.npos) continue;
    const std::string state = line.substr(0, blank), file = line.substr(blank + 1);
    if (state == kGone)
      entries.erase(file);
    else
      entries[file] = state;
  }
  return entries;
}

}  // namespace

codegen::Descriptor lock_results(const std::string& folder) {
  codegen::Descriptor lock(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock.number() < 0 || flock(lock.number(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return lock;
  throw FileError(folder +
                  ": another run is writing its results in this folder; expected one at a time, or "
                  "another folder");
}

ResultMarks::ResultMarks(std::string folder) : folder_(std::move(folder)) {
  if (!is_plain(path(kList))) return;
  const std::string list = bytes_of(path(kList));
  if (std::string_view(kHead).starts_with(list)) return;  // of a process that was killed
  is_list_foreign_ = !list.starts_with(kHead);
  if (is_list_foreign_) return;
  written_ = entries_of(list);
  if (list.size() > kLong) shorten();
}

void ResultMarks::shorten() const {
  std::string text = kHead;
  for (const auto& [file, state] : written_) text += state + " " + file + "\n";
  try {
    write_file_atomically(path(kList), text);
  } catch (const FileError&) {
    // The long one says the same.
  }
}

bool ResultMarks::is_as_written(const std::string& file) const {
  const auto entry = written_.find(file);
  if (entry == written_.end() || !is_plain(path(file))) return false;
  return entry->second == kBegun || entry->second == codegen::checksum(bytes_of(path(file)));
}

std::string ResultMarks::fault_of(const std::string& file) const {
  if (is_list_foreign_) return path(kList) + ": this is not dyntape's list of its results; expected none";
  if (!is_plain(path(file)) || is_as_written(file)) return "";
  const char* const what =
      knows(file) ? "has changed since dyntape wrote it" : "is not one that dyntape has written";
  return path(file) + ": this file " + what +
         ", and would be replaced; expected it elsewhere, or results in another folder";
}

void ResultMarks::append(const std::string& state, const std::string& file) {
  const std::string name = path(kList);
  std::error_code none;
  fs::create_directories(folder_, none);  // where that fails, opening says why
  const codegen::Descriptor list(open(name.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (list.number() < 0) throw FileError(name + ": cannot write: " + std::strerror(errno));
  const off_t size = lseek(list.number(), 0, SEEK_END);
  const bool is_new = size < off_t(std::strlen(kHead));
  if (is_new && ftruncate(list.number(), 0) != 0)
    throw FileError(name + ": cannot write: " + std::strerror(errno));
  // What a process that was killed had begun stays a line of its own.
  char last = '\n';
  const bool is_cut = !is_new && pread(list.number(), &last, 1, size - 1) == 1 && last != '\n';
  const std::string begin = is_new ? kHead : is_cut ? "\n" : "";
  codegen::write_all(list.number(), name, begin + state + " " + file + "\n");
}

void ResultMarks::begin(const std::string& file) {
  append(kBegun, file);
  written_[file] = kBegun;
}

void ResultMarks::end(const std::string& file) {
  const bool is_there = is_plain(path(file));
  const std::string state = is_there ? codegen::checksum(bytes_of(path(file))) : kGone;
  append(state, file);
  if (is_there)
    written_[file] = state;
  else
    written_.erase(file);
  std::error_code none;
  if (written_.empty()) fs::remove(path(kList), none);
}

void ResultFolder::write_text(const char* file, const std::string& text) {
  write(file, [&](const std::string& path) { write_file_atomically(path, text); });
}

void ResultFolder::write_table(const char* file, const CsvTable& table) {
  write(file, [&](const std::string& path) { write_csv(path, table, NonFinite::kAllow); });
}

void ResultFolder::remove(const char* file) {
  std::error_code none;
  const fs::path it = path(file);
  if (!marks_.knows(file)) return;
  if (fs::symlink_status(it, none).type() == fs::file_type::regular && marks_.is_as_written(file))
    fs::remove(it, none);
  try {
    if (!is_plain(it)) marks_.end(file);
  } catch (const FileError&) {
    // A name too many in the list, of a file that is not there.
  }
}

void remove_abandoned(const std::string& folder, const std::vector<std::string>& files) {
  for (const std::string& name : codegen::names_in(folder)) {
    for (const std::string& file : files) {
      std::error_code none;
      if (is_temporary_name_beside(file, name)) fs::remove(folder + "/" + name, none);
    }
  }
}

}  // namespace dyntape::io
