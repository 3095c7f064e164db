// SPDX-License-Identifier: BSD-3-Clause
#include "study.h"

#include <filesystem>
#include <iostream>
#include <memory>

#include <dyntape/interface/io/live_line.h>

#include "bench_commands.h"
#include "commands.h"
#include "report.h"
#include "words.h"

namespace dyntape::tools {
namespace {

struct Wanted {
  StudyOptions options;
  bool redraw = false;
  std::string output;
};

// The folder with robots and tasks: beside an installed command, or that of the source tree.
std::string config_folder(const std::string& wanted) {
  if (!wanted.empty()) return wanted;
  std::error_code none;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", none);
  const auto installed = program.parent_path().parent_path() / "share" / "dyntape";
  return std::filesystem::exists(installed / "robots", none) ? installed.string() : DYNTAPE_CONFIG_FOLDER;
}

void print(const std::vector<std::string>& files) {
  for (const std::string& file : files) std::cout << file << "\n";
}

void run_study(const StudyEntry& entry, Wanted wanted) {
  if (wanted.redraw) {
    Study study = entry.outline();
    study.rows = read_study_csv(wanted.output + "/" + entry.name + ".csv");
    return print(draw_study(study, wanted.output));
  }
  prepare_folder(wanted.output, {std::string(entry.name) + ".csv"});
  wanted.options.config = config_folder(wanted.options.config);
  Study study;
  {
    io::LiveLine line;
    wanted.options.watch = [&line](const std::string& doing) { line.show("measuring " + doing); };
    study = entry.run(wanted.options);
  }
  std::cout << study_text(study) << "\n";
  print(write_study(study, wanted.options, wanted.output));
}

}  // namespace

const std::vector<StudyEntry>& studies() {
  static const std::vector<StudyEntry> all = {
      {"routes",
       "every route to the derivatives of forward dynamics: error against time, and against the step of "
       "differences",
       outline_of_routes, study_routes},
      {"integrators",
       "steps in time: error, drift over a million steps, the largest step, against what a step takes",
       outline_of_integrators, study_integrators},
      {"slopes", "how the cost of the dynamics grows with the number of bodies", outline_of_slopes,
       study_slopes},
      {"compile", "how time and memory from model to library grow with the number of operations",
       outline_of_compile, study_compile},
      {"schemes", "transcription schemes by mesh: error of the cost, true defect, miss, against time",
       outline_of_schemes, study_schemes},
      {"hessians", "iterations, time and optima found, by kind of Hessian and by solver", outline_of_hessians,
       study_hessians},
      {"arithmetic",
       "float to 113 bits, packs, generated code: digits against time, along chains and by mass ratios",
       outline_of_arithmetic, study_arithmetic},
      {"contacts",
       "a block that drops, creeps and slides, a quadruped that stands: compliant and rigid contact, error "
       "against time",
       outline_of_contacts, study_contacts},
      {"effects", "what each effect of a scene adds to a step and to its Jacobians, and what is off",
       outline_of_effects, study_effects},
  };
  return all;
}

void add_study(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "study", "measure what accuracy costs and how cost grows; a table, pictures and a page of each");
  command->require_subcommand(1);
  for (const StudyEntry& entry : studies()) {
    const auto wanted = std::make_shared<Wanted>();
    CLI::App* one = command->add_subcommand(entry.name, entry.what);
    one->add_option("--output", wanted->output, "where the table, the pictures and the page go")
        ->check(not_empty())
        ->required()
        ->type_name("DIR");
    one->add_flag("--redraw", wanted->redraw,
                  "measure nothing: draw the pictures of the table that is there");
    one->add_flag("--quick", wanted->options.quick, "fewer points of the same kinds");
    one->add_option("--seed", wanted->options.seed, "of random states")
        ->transform(seed())
        ->capture_default_str();
    one->add_option("--config", wanted->options.config,
                    "the folder with robots/ and tasks/ (default: the one that came along)")
        ->type_name("DIR");
    one->callback([&entry, wanted] { run_study(entry, *wanted); });
  }
}

}  // namespace dyntape::tools
