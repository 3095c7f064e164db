// SPDX-License-Identifier: BSD-3-Clause
//
// The commands of `dyntape`, one a file.  Each adds itself to the application; its callback does the work and
// throws dyntape::Error for what goes wrong.  A command that ends in anything but full success throws Failure
// after saying so.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/task/centroidal_task.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/result_folder.h>

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

void print_json(const nlohmann::json& report);

template <class Report, class Options>
void print_report(const Report& report, const Options& options) {
  std::cout << (options.json ? report.json() : report.text());
  if (!options.output.empty() && !options.json) std::cout << "\nresults in " << options.output << "\n";
  std::cout << std::flush;
}

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
// FileError where a result would replace what the work reads.
void keep_inputs(const std::string& output, const std::vector<std::string>& inputs);
// FileError where a table, a report or a file of settings, which every run writes, would replace what dyntape has not written.
enum class Changed { kRefused, kAllowed };  // what dyntape has written, and somebody has changed since
void keep_others(const std::string& folder, const std::vector<std::string>& files,
                 Changed changed = Changed::kRefused);

// A folder for these results, all of this, and its lock.  Nothing is removed before there are results to replace it.  Folders that
// it made and that are still empty in the end are removed again.  Without a name there is nothing to do.
class OutputFolder {
 public:
  OutputFolder(const std::string& folder, const std::vector<std::string>& files,
               const std::vector<std::string>& inputs);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  // Of work that fails nothing older is to be taken for its result.
  template <class Work>
  auto hold(const Work& work) const {
    try {
      return work();
    } catch (const Error&) {
      remove_older();
      throw;
    }
  }

 private:
  void remove_older() const;

  std::string folder_;
  std::vector<std::string> files_;
  std::vector<std::filesystem::path> made_;
  codegen::Descriptor lock_;
};

// A file, read once, as it may come by a pipe; and what the command line says in place of it.
struct TextOfFile {
  explicit TextOfFile(const std::string& file, const std::vector<std::string>& set = {});
  std::string path, text;
  std::vector<io::Setting> settings;
};

// The option --set of commands that read an .info file.
void add_settings(CLI::App& command, std::vector<std::string>& set);

// A task file, with a name that reports can carry; one of a robot as one mass.
Task task_in(const TextOfFile& file);
CentroidalTask centroidal_task_in(const TextOfFile& file);

// Whether an .info file has a block of this name: what kind of file it is.  Whatever else is wrong in it; no where what it
// includes cannot be read, which is for its reader to complain of.
bool has_block(const TextOfFile& file, const char* name);

// "tau0", "tau1", ...
std::vector<std::string> numbered(const std::string& prefix, int count);

}  // namespace dyntape::tools
