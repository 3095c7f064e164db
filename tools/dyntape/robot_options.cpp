// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/result_folder.h>

#include "commands.h"
#include "words.h"

namespace dyntape::tools {

void add_robot_options(CLI::App& command, RobotOptions& options) {
  command.add_option("robot", options.path, "the robot, a URDF file")
      ->required()
      ->check(not_empty())
      ->type_name("ROBOT.urdf");
  command
      .add_option("--base", options.base,
                  "fixed: the root link is the world; floating: a free-flyer carries it")
      ->check(CLI::IsMember({"fixed", "floating"}))
      ->type_name("fixed|floating")
      ->capture_default_str();
  command.add_option("--lock", options.lock, "joints held at their neutral position, separated by commas")
      ->delimiter(',')
      ->type_name("J1,J2");
  command
      .add_option("--snap", options.snap,
                  "rotations within this angle [rad] of a right one become exact; 0 reads them literally")
      ->type_name("RAD")
      ->capture_default_str();
  command.add_flag("--mimic", options.mimic,
                   "joints with <mimic> follow their leader and have no entries of their own");
  command
      .add_option(
          "--inertia", options.inertia,
          "what an inertia that no body has is (a principal moment below zero): an error, or a note of "
          "info, and the robot is read as it is written")
      ->check(CLI::IsMember({"error", "warn"}))
      ->type_name("error|warn")
      ->capture_default_str();
}

dynamics::UrdfRobot load_robot(const RobotOptions& options) {
  dynamics::UrdfOptions urdf;
  urdf.base = options.base == "floating" ? dynamics::Base::kFloating : dynamics::Base::kFixed;
  urdf.lock = options.lock;
  urdf.snap = options.snap;
  urdf.mimic = options.mimic;
  urdf.accept_nonphysical_inertia = options.inertia == "warn";
  return dynamics::read_urdf(options.path, urdf);
}

void prepare_folder(const std::string& folder, const std::vector<std::string>& files) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw FileError(folder + ": it is a file; expected a folder, or a name that is free");
  fs::create_directories(folder, error);
  if (error) throw FileError(folder + ": cannot make this folder: " + error.message());
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw FileError(folder + ": cannot write in this folder: " + std::strerror(errno));
  for (const std::string& file : files) check_can_write(folder + "/" + file);
}

ClearedFolder::ClearedFolder(const std::string& folder, const std::vector<std::string>& files,
                             const std::string& input) {
  if (folder.empty()) return;
  std::error_code error;
  std::vector<std::filesystem::path> missing;  // innermost first
  for (std::filesystem::path at = folder; !at.empty() && !std::filesystem::exists(at, error);
       at = at.parent_path())
    missing.push_back(at);
  prepare_folder(folder, files);
  made_ = std::move(missing);
  std::vector<std::string> none;
  const io::ResultFolder results(folder, none);
  for (const std::string& file : files) {
    std::error_code none_there;
    if (!std::filesystem::equivalent(results.path(file.c_str()), input, none_there))
      results.remove(file.c_str());
  }
}

ClearedFolder::~ClearedFolder() {
  for (const std::filesystem::path& at : made_)
    rmdir(at.c_str());  // of one that holds something it does nothing
}

std::vector<std::string> numbered(const std::string& prefix, int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(prefix + std::to_string(i));
  return names;
}

}  // namespace dyntape::tools
