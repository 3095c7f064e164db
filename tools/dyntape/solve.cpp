// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape solve: a task file to a verified motion, with pictures.
#include <iostream>
#include <memory>

#include <dyntape/interface/io/progress.h>
#include <dyntape/interface/ocp/solve.h>

#include "commands.h"

namespace dyntape::tools {
namespace {

struct Options {
  std::string task, output;
  bool explain = false, json = false;
};

void run(const Options& options) {
  const Task task = read_task(options.task);
  if (options.explain) {
    std::cout << explain(task);
    return;
  }
  const SolveReport report = [&] {
    io::Progress progress("recording, compiling, solving", 0);
    progress.update(0, task.name);
    return solve_task(task);
  }();
  const std::string no_picture = options.output.empty() ? "" : write_results(task, report, options.output);
  std::cout << (options.json ? report.json() : report.text());
  if (!options.output.empty() && !options.json) std::cout << "\nresults in " << options.output << "\n";
  if (!no_picture.empty()) std::cerr << "dyntape: " << no_picture << "\n";
  if (!report.success()) {
    std::cerr << "dyntape: " << report.verdict() << "\n";
    throw Failure{};
  }
  if (!no_picture.empty()) throw Failure{};
}

}  // namespace

void add_solve(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "solve",
      "solve a task and verify the motion: record, derive, compile, optimise, re-simulate, draw.\n"
      "The exit status is 0 only if the solver succeeded, the constraints hold when computed anew and a "
      "known\n"
      "optimum, where the task states one, is met");
  const auto options = std::make_shared<Options>();
  command->add_option("task", options->task, "the task, an .info file (config/tasks)")
      ->required()
      ->type_name("TASK.info");
  command->add_option("--output", options->output, "where trajectory.csv, report.json and the pictures go")
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
  command->add_option("file", *file, "the task, an .info file")->required()->type_name("FILE");
  command->add_flag("--effective", *show, "print the file as it is understood, defaults included");
  command->callback([file, show] {
    const Task task = read_task(*file);
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
