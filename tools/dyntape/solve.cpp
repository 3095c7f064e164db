// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape solve: a task file to a verified motion, with pictures.
#include <iostream>
#include <memory>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/progress.h>
#include <dyntape/interface/task/solve.h>

#include "commands.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct SolveOptions {
  std::string task, output;
  bool explain = false, json = false;
};

// With a name that the report can carry: it may be that of the file.
Task task_in(const std::string& file) {
  Task task = read_task(file);
  const std::string fault = fault_of_name(task.name);
  if (!fault.empty()) throw FileError(file + ": the task has a name that " + fault);
  return task;
}

// Once the report is out: the results may not get to where they belong, the work is not lost then.
void write(const Task& task, const SolveReport& report, const SolveOptions& options) {
  const std::string no_picture = write_results(task, report, options.output);
  if (!options.json) std::cout << "\nresults in " << options.output << "\n";
  if (no_picture.empty()) return;
  std::cerr << "dyntape: " << no_picture << "\n";
  throw Failure{};
}

void run(const SolveOptions& options) {
  const Task task = task_in(options.task);
  if (options.explain) {
    std::cout << explain(task);
    return;
  }
  if (!options.output.empty()) prepare_folder(options.output, result_files());
  const SolveReport report = [&] {
    io::Progress progress("recording, compiling, solving", 0);
    progress.update(0, task.name);
    return solve_task(task);
  }();
  std::cout << (options.json ? report.json() : report.text()) << std::flush;
  if (!report.success()) std::cerr << "dyntape: " << report.verdict() << "\n";
  if (!options.output.empty()) write(task, report, options);
  if (!report.success()) throw Failure{};
}

}  // namespace

void add_solve(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "solve",
      "solve a task and verify the motion: record, derive, compile, optimise, re-simulate, draw.\n"
      "The exit status is 0 only if the solver succeeded, the constraints hold when computed anew and a "
      "known\n"
      "optimum, where the task states one, is met");
  const auto options = std::make_shared<SolveOptions>();
  command->add_option("task", options->task, "the task, an .info file (config/tasks)")
      ->required()
      ->check(not_empty())
      ->type_name("TASK.info");
  command->add_option("--output", options->output, "where trajectory.csv, report.json and the pictures go")
      ->check(not_empty())
      ->type_name("DIR");
  command->add_flag(
      "--explain", options->explain,
      "print the resolved scene, which effects act and what each costs in operations; solve nothing");
  command->add_flag("--json", options->json, "the report for programs");
  command->callback([options] { run(*options); });
}

void add_check_config(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "check-config",
      "read a task file and its robot strictly; print every problem with file, line and column");
  const auto file = std::make_shared<std::string>();
  const auto show = std::make_shared<bool>(false);
  command->add_option("file", *file, "the task, an .info file")
      ->required()
      ->check(not_empty())
      ->type_name("FILE");
  command->add_flag("--effective", *show, "print the file as it is understood, defaults included");
  command->callback([file, show] {
    const Task task = task_in(*file);
    if (*show) {
      std::cout << task.effective;
      return;
    }
    std::cout << *file << ": sound (" << task.problem.n_x() << " states, " << task.problem.n_u()
              << " controls)\n";
    for (const std::string& note : task.notes) std::cout << "note: " << note << "\n";
  });
}

}  // namespace dyntape::tools
