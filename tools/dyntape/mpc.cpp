// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape mpc: a task as a controller, and the plant that it steers.
#include <atomic>
#include <iostream>
#include <memory>

#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/mpc/centroidal_control.h>
#include <dyntape/interface/run/mpc/mpc_task.h>

#include "commands.h"
#include "interruption.h"
#include "words.h"

namespace dyntape::tools {

namespace {

struct ControlOptions {
  std::string task, output;
  std::vector<std::string> set;
  bool json = false;
};

// Of a robot's joints, or of a robot as one mass.
template <class AnyTask>
void run_control(const ControlOptions& options, const AnyTask& task, const std::vector<std::string>& files) {
  const OutputFolder folder(options.output, files, task.inputs);
  io::LiveLine line;
  line.show("recording and compiling");
  std::atomic<bool> has_begun = false;
  const Interruption interruption([&] { return !has_begun; });
  const auto watch = [&](double t) {
    has_begun = true;
    line.show("closed loop: " + io::significant(t, 4) + " of " + io::significant(task.control.seconds, 4) +
              " s");
  };
  ControlReport report = folder.hold([&] { return control_task(task, interruption.token(), watch); });
  line.erase();
  if (!options.output.empty()) write_control(task, report, options.output, interruption.token());
  std::cout << (options.json ? report.json() : report.text());
  if (!options.json)
    for (const std::string& note : folded(task.notes)) std::cout << "note: " << note << "\n";
  if (!options.output.empty() && !options.json) std::cout << "\nresults in " << options.output << "\n";
  std::cout << std::flush;
  if (!report.loop.trouble.empty()) std::cerr << "dyntape: " << report.loop.trouble << "\n";
  if (!report.is_in_time())
    std::cerr << "dyntape: " << report.loop.missed(report.deadline) << " of " << report.loop.steps.size() - 1
              << " later steps took longer than the period of " << 1e3 * report.deadline
              << " ms; expected fewer intervals, a longer period, or a greater part in mpc.max_late\n";
  if (const ClosedLoop::Step* first = report.first_unusable())
    std::cerr << "dyntape: " << report.loop.unusable() << " of " << report.loop.steps.size()
              << " plans were not usable, and the one before was followed; the first, at "
              << io::significant(first->t, 4) << " s: " << describe(first->status) << "\n";
  for (const std::string& sentence : report.unwritten) std::cerr << "dyntape: " << sentence << "\n";
  if (interruption.token().stop_requested()) throw Failure{interruption.status()};
  if (!report.success() || !report.unwritten.empty()) throw Failure{};
}

void run_control(const ControlOptions& options) {
  const TextOfFile file(options.task, options.set);
  if (has_block(file, "centroidal"))
    run_control(options, centroidal_task_in(file), centroidal_files());
  else
    run_control(options, task_in(file), control_files());
}

}  // namespace

void add_mpc(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("mpc",
                         "model predictive control: plan a task's motion again and again from the state of "
                         "the simulated robot,\nwith the disturbances and the delay of the task's block mpc. "
                         " The exit status is 0 only if every plan\nwas usable");
  const auto options = std::make_shared<ControlOptions>();
  add_path(*command, "task", options->task,
           "the task, an .info file with costs.tracking (config/control/arm_holds.info), or with a block "
           "centroidal for a legged robot as a single mass (config/control/solo12_pushed.info)",
           "TASK.info")
      ->required();
  add_path(*command, "--output", options->output, "folder for closed_loop.csv, report.json and pictures",
           "DIR");
  add_settings(*command, options->set);
  command->add_flag("--json", options->json, "print the report as JSON");
  command->callback([options] { run_control(*options); });
}

}  // namespace dyntape::tools
