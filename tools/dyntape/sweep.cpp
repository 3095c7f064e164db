// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape sweep: a scene with many values of some of its numbers, to a table with a row for each.
#include "sweep.h"

#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/simulation_results.h>
#include <dyntape/interface/report/sweep_results.h>

#include "commands.h"
#include "interruption.h"
#include "words.h"

namespace dyntape::tools {

namespace {

struct SweepWords {
  std::string file, output;
  bool restart = false, json = false;
  std::optional<long> sample;
  std::vector<std::string> set;
};

void print(const SweepReport& report, const SweepWords& words, const Scene& scene) {
  std::cout << (words.json ? report.json() : report.text());
  if (!words.json)
    for (const std::string& note : folded(scene.notes)) std::cout << "note: " << note << "\n";
  if (!words.json) std::cout << "\nresults in " << words.output << "\n";
  std::cout << std::flush;
  for (const std::string& sentence : report.unwritten) std::cerr << "dyntape: " << sentence << "\n";
}

SweepOutcome watched_sweep(const SceneSweep& sweep, SweepFolder& folder, SweepPeers* peers,
                           const Interruption& interruption) {
  io::LiveLine line;
  try {
    const auto tell = [&](const std::string& what) { line.show(what); };
    return run_sweep(sweep, folder, {interruption.token(), tell, peers});
  } catch (const Error&) {
    line.erase();
    if (!interruption.status()) throw;
    std::cerr << "dyntape: interrupted before the first sample\n";
    throw Failure{interruption.status()};
  }
}

void sweep_all(const SweepWords& words, const SceneSweep& sweep, SweepPeers* peers) {
  prepare_folder(words.output, sweep_files());
  for (const std::string& file : sweep_files()) keep_inputs(words.output + "/" + file, sweep.inputs);
  const Restart restart = words.restart ? Restart::kYes : Restart::kNo;
  keep_others(words.output, sweep_files(), restart == Restart::kYes ? Changed::kAllowed : Changed::kRefused);
  SweepFolder folder(words.output, sweep, restart);
  if (folder.is_finished()) {
    const SweepReport report{sweep, finished_outcome(sweep, words.output)};
    folder.clear();
    print(report, words, sweep.scene);
    if (!report.success()) throw Failure{};
    return;
  }
  const Interruption interruption([] { return false; });
  if (folder.kept() > 0) {
    std::cerr << "dyntape: resumed, " << folder.kept() << " of " << chunks_of(sweep)
              << " chunks were there\n";
  }
  SweepReport report{sweep, watched_sweep(sweep, folder, peers, interruption)};
  if (report.outcome.was_stopped) {
    std::cerr << "dyntape: " << sweep.name << ": " << report.verdict() << "\n";
    throw Failure{interruption.status()};
  }
  write_sweep_results(report, words.output, interruption.token());
  if (report.unwritten.empty()) folder.clear();
  print(report, words, sweep.scene);
  if (interruption.status()) throw Failure{interruption.status()};
  if (!report.success()) std::cerr << "dyntape: " << sweep.name << ": every sample failed\n";
  if (!report.success() || !report.unwritten.empty()) throw Failure{};
}

// One of the samples as a scene of its own, with its motion and pictures.
void simulate_sample(const SweepWords& words, const SceneSweep& sweep) {
  if (*words.sample >= sweep.rows())
    throw ArgumentError("--sample " + std::to_string(*words.sample) + ": the sweep has samples 0 to " +
                        std::to_string(sweep.rows() - 1));
  const Scene scene = scene_of(sweep, *words.sample);
  const OutputFolder folder(words.output, simulation_files(), scene.inputs);
  const Interruption interruption([] { return false; });
  io::LiveLine line;
  const auto tell = [&](const std::string& what) { line.show(what); };
  SimulationReport report{scene, folder.hold([&] { return simulate(scene, {interruption.token(), tell}); })};
  line.erase();
  write_results(report, words.output, interruption.token());
  std::cout << (words.json ? report.json() : report.text()) << std::flush;
  for (const std::string& sentence : report.unwritten) std::cerr << "dyntape: " << sentence << "\n";
  if (report.motion.was_stopped) throw Failure{interruption.status()};
  if (!report.success() || !report.unwritten.empty()) throw Failure{};
}

void sweep(const SweepWords& words, const SweepSide& side) {
  if (side.master) return serve_sweep(words.file, io::settings_of(words.set), *side.master);
  const SceneSweep sweep = read_sweep(words.file, io::settings_of(words.set));
  if (const std::string fault = fault_of_name(sweep.name); !fault.empty())
    throw FileError(words.file + ": the sweep has a name that " + fault);
  if (words.sample) return simulate_sample(words, sweep);
  sweep_all(words, sweep, side.peers);
}

}  // namespace

bool is_one_of_several() {
  for (const char* count : {std::getenv("OMPI_COMM_WORLD_SIZE"), std::getenv("PMI_SIZE")}) {
    if (count && io::parse_number<int>(count).value_or(1) > 1) return true;
  }
  return false;
}

void add_sweep_command(CLI::App& app, const SweepSide& side) {
  CLI::App* command = app.add_subcommand(
      "sweep",
      "simulate a scene for many values of some of its numbers.  One step is compiled with these numbers\nas "
      "parameters; the samples run in SIMD lanes and threads.\nFinished samples are on disk at once: repeat "
      "the command to continue an interrupted sweep.  Ctrl-C\nends within a second, with status 130.  On "
      "several machines: mpirun -n 7 dyntape sweep ...\nThe exit status is 0 if all samples were simulated "
      "and not every one failed");
  const auto words = std::make_shared<SweepWords>();
  add_path(*command, "sweep", words->file, "the sweep, an .info file (config/sweeps)", "SWEEP.info")
      ->required();
  add_path(*command, "--output", words->output, "folder for sweep.csv, sweep.svg and report.json", "DIR")
      ->required();
  command->add_flag("--restart", words->restart,
                    "remove the files of an earlier sweep from DIR, and start again");
  command
      ->add_option("--sample", words->sample,
                   "simulate this sample only, and write the results of `simulate` into DIR")
      ->transform(whole_number(0L, kMostRows))
      ->type_name("I");
  add_settings(*command, words->set);
  command->add_flag("--json", words->json, "print the report as JSON");
  command->callback([words, side] { sweep(*words, side); });
}

void add_sweep(CLI::App& app) { add_sweep_command(app, {}); }

}  // namespace dyntape::tools
