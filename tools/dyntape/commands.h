// SPDX-License-Identifier: BSD-3-Clause
//
// The commands of `dyntape`, one a file.  Each adds itself to the application; its callback does the work and
// throws dyntape::Error for what goes wrong.  A command that ends in anything but full success throws Failure
// after saying so.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/task/centroidal_task.h>

namespace dyntape::tools {

// Each is add_<name>(app) in <name>.cpp, in the order of `dyntape --help`.
#define DYNTAPE_COMMANDS(X) \
  X(info)                   \
  X(eval) X(generate) X(simulate) X(sweep) X(solve) X(mpc) X(identify) X(check_config) X(cache) X(doctor)
#define DYNTAPE_DECLARE(name) void add_##name(CLI::App& app);
DYNTAPE_COMMANDS(DYNTAPE_DECLARE)
#undef DYNTAPE_DECLARE

// The outcome has been reported already; only the exit status is left.
struct Failure {
  int status = 1;
};

// Options of every command that reads a robot.
struct RobotOptions {
  std::string path;
  std::string base = "fixed";
  std::vector<std::string> lock;
  double snap = 1e-8;
  bool mimic = false;
  std::string inertia = "error";
};
void add_robot_options(CLI::App& command, RobotOptions& options);
dynamics::UrdfRobot load_robot(const RobotOptions& options);

// Makes the folder for these files and tries what can be tried, before the work whose results they are to hold.
void prepare_folder(const std::string& folder, const std::vector<std::string>& files);
// The same, and removes what an earlier run has left there, but `input`: of a run that fails nothing older is to be taken for its
// result.  Folders that it made and that are still empty in the end are removed again.  Without a name there is nothing to do.
class ClearedFolder {
 public:
  ClearedFolder(const std::string& folder, const std::vector<std::string>& files, const std::string& input);
  ~ClearedFolder();
  ClearedFolder(const ClearedFolder&) = delete;
  ClearedFolder& operator=(const ClearedFolder&) = delete;

 private:
  std::vector<std::filesystem::path> made_;
};

// A task file, with a name that reports can carry; one of a robot as one mass.
Task task_in(const std::string& file);
CentroidalTask centroidal_task_in(const std::string& file);

// Whether an .info file has a block of this name: what kind of file it is.  Whatever else is wrong in it; no where it
// cannot be read, which is for its reader to complain of.
bool has_block(const std::string& file, const char* name);

// "tau0", "tau1", ...
std::vector<std::string> numbered(const std::string& prefix, int count);

}  // namespace dyntape::tools
