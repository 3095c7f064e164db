// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape solve: a task file to a verified motion, with pictures.
#include <atomic>
#include <iostream>
#include <memory>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/info/info.h>
#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/run/solve/solve.h>

#include "commands.h"
#include "interruption.h"
#include "words.h"

namespace dyntape::tools {

namespace {

void check_name(const std::string& file, const std::string& name) {
  const std::string fault = fault_of_name(name);
  if (!fault.empty()) throw FileError(file + ": the task has a name that " + fault);
}

}  // namespace

TextOfFile::TextOfFile(const std::string& file, const std::vector<std::string>& set)
    : path(file), text(read_file(file)), settings(io::settings_of(set)) {}

Task task_in(const TextOfFile& file) {
  if (has_block(file, "centroidal"))
    throw FileError(
        file.path +
        ": it is about a robot as one mass ('centroidal'), which `dyntape mpc` steers; expected a task");
  Task task = read_task_text(file.text, file.path, file.settings);
  check_name(file.path, task.name);
  return task;
}

CentroidalTask centroidal_task_in(const TextOfFile& file) {
  CentroidalTask task = read_centroidal_task_text(file.text, file.path, file.settings);
  check_name(file.path, task.name);
  return task;
}

bool has_block(const TextOfFile& file, const char* name) {
  try {
    return io::scan_info(file.text, file.path).root.child(name) != nullptr;
  } catch (const FileError&) {
    return false;
  }
}

namespace {

struct SolveOptions {
  std::string task, output;
  std::vector<std::string> set;
  bool explain = false, json = false;
};

// The solve, shown while it runs.
class SolveDisplay {
 public:
  explicit SolveDisplay(const Task& task) : silent_solver_(task.optimise.solver.print_level == 0) {}

  void show(const SolveMoment& moment) {
    if (moment.now) has_iterated_ = true;
    if (!moment.now) line_.show(moment.text());
    if (moment.now && silent_solver_) line_.show(moment.text());
  }
  void erase() { line_.erase(); }
  bool has_iterated() const { return has_iterated_; }  // for any thread

 private:
  io::LiveLine line_;
  std::atomic<bool> has_iterated_ = false;
  const bool silent_solver_;  // or the terminal is its own
};

SolveReport watched(const Task& task, SolveDisplay& display, const Interruption& interruption) {
  try {
    const SolveReport report =
        solve_task(task, {interruption.token(), [&](const SolveMoment& moment) { display.show(moment); }});
    display.erase();
    return report;
  } catch (const Interrupted& e) {
    display.erase();
    std::cerr << "dyntape: " << e.what() << "\n";
    throw Failure{interruption.status()};
  }
}

// The report in words begins with the verdict.  It is repeated below it for a failure, not for an interruption, which
// the user knows of.
void print_trouble(const Task& task, const SolveReport& report, bool json) {
  if (!report.success()) {
    if (json || !report.interrupted) std::cerr << "dyntape: " << report.verdict() << "\n";
    for (const std::string& note : folded(task.notes)) std::cerr << "dyntape: note: " << note << "\n";
  }
  for (const std::string& sentence : report.unwritten) std::cerr << "dyntape: " << sentence << "\n";
}

void run(const SolveOptions& options) {
  const Task task = task_in(TextOfFile(options.task, options.set));
  if (options.explain) {
    std::cout << explain(task);
    return;
  }
  const OutputFolder folder(options.output, result_files(), task.inputs);
  for (const std::string& sentence : unmet_demands(task)) std::cerr << "dyntape: note: " << sentence << "\n";
  SolveDisplay display(task);
  const Interruption interruption([&] { return !display.has_iterated(); });
  SolveReport report = folder.hold([&] { return watched(task, display, interruption); });
  if (!options.output.empty()) write_results(task, report, options.output, interruption.token());
  print_report(report, options);
  print_trouble(task, report, options.json);
  if (report.interrupted) throw Failure{interruption.status()};
  if (!report.success() || !report.unwritten.empty()) throw Failure{};
}

}  // namespace

void add_solve(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "solve",
      "solve a task and verify the motion: record, derive, compile, optimise, re-simulate, draw.\nThe mesh "
      "is refined until a simulation with the controls reproduces the motion.  The exit status is 0\nonly if "
      "the solver succeeded, the recomputed constraints hold, the simulation agrees, no limit of the\nrobot "
      "is exceeded, and the cost is the known optimum if the task states one.  Ctrl-C writes the "
      "best\nmotion so far and exits with status 130; a second Ctrl-C exits at once");
  const auto options = std::make_shared<SolveOptions>();
  add_path(*command, "task", options->task, "the task, an .info file (config/tasks)", "TASK.info")
      ->required();
  add_path(*command, "--output", options->output, "folder for trajectory.csv, report.json and pictures",
           "DIR");
  command->add_flag("--explain", options->explain,
                    "print the complete scene and the effects with their cost in operations; solve nothing");
  add_settings(*command, options->set);
  command->add_flag("--json", options->json, "print the report as JSON");
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
