// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/sweep/sweep_folder.h>

#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>

namespace dyntape {

namespace {

namespace fs = std::filesystem;

constexpr int kChunkFormat = 1;
constexpr const char *kChunks = "chunks", *kRows = ".rows", *kLock = ".lock", *kChunkHead = "dyntape-sweep ",
                     *kEnd = "end ", *kFailure = "! ";

std::string written(const ValuePlace& at) {
  std::string text = std::to_string(at.index());
  const auto entries = [&](const std::vector<int>& all) {
    for (int entry : all) text += " " + std::to_string(entry);
  };
  if (const auto* place = std::get_if<EffectPlace>(&at)) {
    text += place->path + " " + std::to_string(place->item);
    entries(place->entries);
  }
  if (const auto* place = std::get_if<RobotPlace>(&at)) text += place->name;
  if (const auto* place = std::get_if<StartPlace>(&at)) {
    text += " " + std::to_string(int(place->block));
    entries(place->entries);
  }
  if (const auto* place = std::get_if<BasePlace>(&at)) {
    BaseStart which;
    (which.*(place->part))[place->axis] = 1;
    for (const Eigen::Vector3d* part :
         {&which.position, &which.roll_pitch_yaw, &which.velocity, &which.angular_velocity})
      for (double x : *part) text += x != 0 ? "1" : "0";
  }
  return text;
}

std::string written(const SweptValue& value) {
  std::string text = value.name + " " + written(value.place) + " " + std::to_string(int(value.spread));
  for (double x : {value.from, value.to, value.mean, value.deviation}) text += " " + io::shortest(x);
  return text + " " + std::to_string(value.steps) + "\n";
}

// Without paths: what these files hold stands for them.
std::string without_paths(const std::string& effective) {
  std::istringstream lines(effective);
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t key = std::min(line.find_first_not_of(' '), line.size());
    if (!line.substr(key).starts_with("urdf ") && !line.substr(key).starts_with("file ")) text += line + "\n";
  }
  return text;
}

std::string header_of(const SceneSweep& sweep, const std::string& identity, long chunk) {
  const ChunkRange range = range_of(sweep, chunk);
  return kChunkHead + identity + " chunk " + std::to_string(chunk) + " rows " + std::to_string(range.first) +
         " to " + std::to_string(range.first + range.count - 1) + "\n";
}

// Whether it is a whole chunk, of whatever sweep.
bool is_whole(const std::string& text) {
  const std::size_t end = text.rfind(std::string("\n") + kEnd);
  if (end == std::string::npos) return false;
  const std::string body = text.substr(0, end + 1);
  return text == body + kEnd + codegen::checksum(body) + "\n";
}

std::string identity_in(const std::string& header) {
  if (!header.starts_with(kChunkHead)) return "";
  const std::string rest = header.substr(std::strlen(kChunkHead));
  return rest.substr(0, rest.find_first_of(" \n"));
}

// "" where there is none, or none that a sweep has written.
std::string identity_of_results(const std::string& report) {
  std::error_code none;
  if (!fs::is_regular_file(report, none)) return "";
  const auto json = nlohmann::json::parse(read_file(report), nullptr, false);
  return json.is_object() && json.contains("identity") && json["identity"].is_string()
             ? json["identity"].get<std::string>()
             : "";
}

// Whether the results in a folder are there to the last byte: the table, the report, and what it says of samples that failed.
bool are_whole(const io::ResultMarks& marks, const std::string& folder) {
  if (!marks.is_as_written(kSweepTable) || !marks.is_as_written(kSweepReport)) return false;
  const auto json = nlohmann::json::parse(read_file(folder + "/" + kSweepReport), nullptr, false);
  const bool has_failures = !json.is_object() || json.value("failed", 0L) > 0;
  return !has_failures || marks.is_as_written(kSweepFailures);
}

bool begins_with(const std::string& path, const std::string& head) {
  std::string begin(head.size(), '\0');
  std::ifstream(path, std::ios::binary).read(begin.data(), std::streamsize(begin.size()));
  return begin == head;
}

std::string name_of_chunk(long chunk) {
  std::string number = std::to_string(chunk);
  number.insert(0, number.size() < 6 ? 6 - number.size() : 0, '0');
  return number + kRows;
}

// Of any sweep.
bool is_chunk(const std::string& path) {
  const std::string name = fs::path(path).filename().string();
  std::error_code none;
  return name.size() > std::strlen(kRows) && name.ends_with(kRows) &&
         name.find_first_not_of("0123456789") == name.size() - std::strlen(kRows) &&
         fs::symlink_status(path, none).type() == fs::file_type::regular && begins_with(path, kChunkHead);
}

// Who holds the lock is alone.
void remove_unfinished(const std::string& chunks) {
  for (const std::string& name : codegen::names_in(chunks)) {
    const std::size_t end = name.find('.', 1);
    std::error_code none;
    if (name.starts_with(".") && end != name.npos &&
        is_temporary_name_beside(name.substr(1, end - 1) + kRows, name))
      fs::remove(chunks + "/" + name, none);
  }
}

codegen::Descriptor locked(const std::string& folder) {
  const std::string path = folder + "/" + kLock;
  std::error_code none;
  if (fs::exists(path, none) && fs::file_size(path, none) > 0 && !begins_with(path, kChunkHead))
    throw FileError(path + ": this is not the lock of a sweep; expected it elsewhere, or another folder");
  codegen::Descriptor lock(open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644));
  if (lock.number() < 0) throw FileError(path + ": cannot make this file: " + std::strerror(errno));
  codegen::write_all(lock.number(), path, kChunkHead);
  if (flock(lock.number(), LOCK_EX | LOCK_NB) == 0) return lock;
  if (errno != EWOULDBLOCK) return lock;  // a file system without locks
  throw FileError(folder + ": another sweep is running in this folder; expected one at a time");
}

}  // namespace

std::vector<std::string> sweep_files() {
  return {kSweepTable, kSweepFailures, kSweepUnderstood, kSweepPicture, kSweepReport};
}

std::string identity_of(const SceneSweep& sweep, const std::string& program) {
  std::string text = "format " + std::to_string(kChunkFormat) + " of " + program + "\n";
  text += "samples " + std::to_string(sweep.samples) + " seed " + std::to_string(sweep.seed) + " at a time " +
          std::to_string(rows_at_a_time(sweep)) + "\n";
  for (const SweptValue& value : sweep.values) text += written(value);
  text += without_paths(sweep.scene.effective);
  for (double t : sweep.scene.commands.t) text += io::shortest(t) + " ";
  for (double u : sweep.scene.commands.u.reshaped()) text += io::shortest(u) + " ";
  return codegen::checksum(text + "\n" + read_file(sweep.scene.urdf));
}

long chunks_of(const SceneSweep& sweep) {
  const long at_a_time = rows_at_a_time(sweep);
  return (sweep.rows() + at_a_time - 1) / at_a_time;
}

ChunkRange range_of(const SceneSweep& sweep, long chunk) {
  const long first = chunk * rows_at_a_time(sweep);
  return {first, std::min(rows_at_a_time(sweep), sweep.rows() - first)};
}

std::string chunk_text(const SceneSweep& sweep, const std::string& identity, long chunk,
                       const ComputedRows& rows) {
  std::string text = header_of(sweep, identity, chunk) + rows.text;
  for (const std::string& failure : rows.failures) text += kFailure + failure + "\n";
  return text + kEnd + codegen::checksum(text) + "\n";
}

SweepFolder::SweepFolder(const std::string& folder, const SceneSweep& sweep, Restart restart)
    : sweep_(sweep),
      folder_(folder),
      identity_(identity_of(sweep)),
      chunks_(std::size_t(chunks_of(sweep)), 0) {
  const std::string chunks = folder + "/" + kChunks;
  std::error_code error;
  fs::create_directories(chunks, error);
  if (error) throw FileError(chunks + ": cannot make this folder: " + error.message());
  lock_ = locked(chunks);
  try {
    lock_of_results_ = io::lock_results(folder);
  } catch (const FileError&) {
    remove_empty_chunks();
    throw;
  }
  refuse_others_chunks();
  remove_unfinished(chunks);
  io::remove_abandoned(folder, sweep_files());
  if (restart == Restart::kYes) {
    begin_anew();
    return;
  }
  const io::ResultMarks marks(folder);
  const std::string results =
      marks.knows(kSweepReport) ? identity_of_results(folder + "/" + kSweepReport) : "";
  if (!results.empty()) refuse_other(results);
  is_finished_ = results == identity_ && are_whole(marks, folder);
  if (!is_finished_) look();
}

void SweepFolder::refuse_others_chunks() const {
  for (std::size_t chunk = 0; chunk < chunks_.size(); ++chunk) {
    std::error_code none;
    const std::string path = path_of(long(chunk));
    if (fs::exists(fs::symlink_status(path, none)) && !is_chunk(path))
      throw FileError(
          path +
          ": this is no chunk of a sweep, and would be replaced by one; expected it elsewhere, or "
          "another folder");
  }
}

void SweepFolder::begin_anew() {
  const std::string chunks = folder_ + "/" + kChunks;
  std::error_code none;
  for (const std::string& name : codegen::names_in(chunks)) {
    if (is_chunk(chunks + "/" + name)) fs::remove(chunks + "/" + name, none);
  }
  io::ResultMarks marks(folder_);
  for (const std::string& file : sweep_files()) {
    const std::string path = folder_ + "/" + file;
    if (!marks.knows(file) || fs::symlink_status(path, none).type() != fs::file_type::regular) continue;
    fs::remove(path, none);
    marks.end(file);
  }
}

void SweepFolder::refuse_other(const std::string& other) const {
  if (other == identity_) return;
  throw FileError(
      folder_ +
      " holds another sweep: this one, its scene, its robot or dyntape itself has changed since; expected an "
      "empty folder, or --restart, which removes what is there");
}

void SweepFolder::look() {
  for (std::size_t chunk = 0; chunk < chunks_.size(); ++chunk) {
    std::error_code none;
    const std::string path = path_of(long(chunk));
    if (!fs::exists(path, none)) continue;
    const std::string text = read_file(path);
    if (!is_whole(text)) continue;  // damaged since: computed anew
    refuse_other(identity_in(text));
    chunks_[chunk] = text.starts_with(header_of(sweep_, identity_, long(chunk)));
  }
}

std::string SweepFolder::path_of(long chunk) const {
  return folder_ + "/" + kChunks + "/" + name_of_chunk(chunk);
}

long SweepFolder::kept() const { return std::count(chunks_.begin(), chunks_.end(), 1); }

void SweepFolder::keep(long chunk, const std::string& text) {
  if (chunk < 0 || chunk >= long(chunks_.size()) || !text.starts_with(header_of(sweep_, identity_, chunk)) ||
      !is_whole(text))
    throw FileError("rows of chunk " + std::to_string(chunk) + " have arrived damaged");
  if (has(chunk)) return;
  write_file_atomically(path_of(chunk), text);
  chunks_[std::size_t(chunk)] = 1;
}

ComputedRows SweepFolder::all() const {
  ComputedRows rows;
  for (long chunk = 0; chunk < long(chunks_.size()); ++chunk) {
    const std::string text = read_file(path_of(chunk));
    if (!is_whole(text) || !text.starts_with(header_of(sweep_, identity_, chunk)))
      throw FileError(path_of(chunk) + ": has changed while the sweep ran");
    std::istringstream lines(text.substr(text.find('\n') + 1));
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(kFailure)) {
        rows.failures.push_back(line.substr(std::strlen(kFailure)));
      } else if (!line.starts_with(kEnd)) {
        rows.text += line + "\n";
      }
    }
  }
  return rows;
}

void SweepFolder::clear() {
  std::error_code none;
  for (long chunk = 0; chunk < long(chunks_.size()); ++chunk) fs::remove(path_of(chunk), none);
  remove_empty_chunks();
}

void SweepFolder::remove_empty_chunks() const {
  std::error_code none;
  fs::remove(folder_ + "/" + kChunks + "/" + kLock, none);
  fs::remove(folder_ + "/" + kChunks, none);
}

}  // namespace dyntape
