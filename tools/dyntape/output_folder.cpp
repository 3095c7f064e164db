// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>

#include "commands.h"

namespace dyntape::tools {

namespace fs = std::filesystem;

void prepare_folder(const std::string& folder, const std::vector<std::string>& files) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw FileError(folder + ": it is a file; expected a folder, or a name that is free");
  fs::create_directories(folder, error);
  if (error) throw FileError(folder + ": cannot make this folder: " + error.message());
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw FileError(folder + ": cannot write in this folder: " + std::strerror(errno));
  for (const std::string& file : files) check_can_write(folder + "/" + file);
}

void keep_inputs(const std::string& output, const std::vector<std::string>& inputs) {
  std::error_code none_there;
  if (!fs::is_regular_file(output, none_there)) return;
  for (const std::string& input : inputs) {
    if (fs::equivalent(output, input, none_there))
      throw FileError(
          output + ": this file is read here, and would be replaced by results; expected results elsewhere");
  }
}

void keep_others(const std::string& folder, const std::vector<std::string>& files, Changed changed) {
  const io::ResultMarks marks(folder);
  for (const std::string& file : files) {
    const std::string extension = fs::path(file).extension().string();
    const bool is_of_every_run = extension == ".csv" || extension == ".json" || extension == ".info";
    if (!is_of_every_run || (changed == Changed::kAllowed && marks.knows(file))) continue;
    if (const std::string fault = marks.fault_of(file); !fault.empty()) throw FileError(fault);
  }
}

OutputFolder::OutputFolder(const std::string& folder, const std::vector<std::string>& files,
                           const std::vector<std::string>& inputs)
    : folder_(folder), files_(files) {
  if (folder.empty()) return;
  std::error_code error;
  std::vector<fs::path> missing;  // innermost first
  for (fs::path at = folder; !at.empty() && !fs::exists(at, error); at = at.parent_path())
    missing.push_back(at);
  prepare_folder(folder, files);
  made_ = std::move(missing);
  lock_ = io::lock_results(folder);
  for (const std::string& file : files) keep_inputs(folder + "/" + file, inputs);
  keep_others(folder, files);
  io::remove_abandoned(folder, files);
}

void OutputFolder::remove_older() const {
  if (folder_.empty()) return;
  std::vector<std::string> none;
  io::ResultFolder results(folder_, none);
  for (const std::string& file : files_) results.remove(file.c_str());
}

OutputFolder::~OutputFolder() {
  for (const fs::path& at : made_) rmdir(at.c_str());  // of one that holds something it does nothing
}

}  // namespace dyntape::tools
