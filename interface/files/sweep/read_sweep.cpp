// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/file_kind.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/old_names.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/files/sweep/value_keys.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using io::Section;

// Of the problems of another file the first, and how many there are.
std::string first_of(const std::string& problems) {
  const auto more = std::count(problems.begin(), problems.end(), '\n');
  const std::string first = problems.substr(0, problems.find('\n'));
  return more == 0 ? first : first + " (and " + std::to_string(more) + " more; check-config lists them)";
}

// The scene that the file names, where there is one without problems.
bool take_swept_scene(Section& file, SceneSweep& sweep) {
  const std::string name =
      file.about("path of the scene or task whose numbers vary, relative to the folder of this file")
          .get<std::string>("scene");
  if (name.empty()) return false;
  try {
    sweep.scene = read_scene(path_beside(sweep.file, file, "scene", name));
    const bool has_loops = !sweep.scene.robot.constraints.loops.empty();
    if (!has_loops && !sweep.scene.commands.followed) return true;
    file.problem("scene", "'" + name + "' has " + (has_loops ? "loops" : "motors that follow a motion") +
                              ", which only simulate knows");
    return false;
  } catch (const Error& e) {
    file.problem("scene", first_of(e.what()));
    return false;
  }
}

void read_values(Section& file, SceneSweep& sweep, bool known) {
  Section vary = file.about("the numbers that vary").child("vary");
  std::vector<Section> blocks;
  if (vary.about("one varied number, or one number for several joints").has("value"))
    blocks = vary.children("value");
  if (blocks.empty()) blocks.push_back(vary.child("value"));  // the list of keys, or a problem
  // Before any value has a column.
  const std::vector<std::string> taken = known ? row_names(sweep) : std::vector<std::string>{};
  for (Section& block : blocks) {
    const std::optional<SweptValue> value = read_value(block, known ? &sweep.scene : nullptr);
    if (!value) continue;
    if (contains(taken, value->name))
      block.problem("name",
                    "the results have a column '" + value->name + "' of their own; expected another name");
    for (const SweptValue& other : sweep.values) {
      if (overlap(value->place, other.place)) {
        block.problem("parameter",
                      "'" + value->name + "' varies with '" + other.name + "' already, expected once");
      } else if (value->name == other.name) {
        block.problem("name", "two values are called '" + value->name + "', expected different names");
      }
    }
    sweep.values.push_back(*value);
  }
}

void read_counts(Section& file, SceneSweep& sweep) {
  const bool is_random = std::any_of(sweep.values.begin(), sweep.values.end(),
                                     [](const SweptValue& v) { return v.spread != Spread::kGrid; });
  file.about("number of samples; with a grid: samples per point of the grid");
  const bool is_given = file.has("samples");
  sweep.samples = file.get_or("samples", 1L, io::between(1, double(kMostRows)));
  if (is_random && !is_given) file.problem("samples", "required key 'samples' is missing: values are random");
  if (!sweep.values.empty() && !is_random && sweep.samples > 1)
    file.problem("samples", "'samples' is " + std::to_string(sweep.samples) +
                                ", but nothing is random: all would be the same");
  sweep.seed = file.about("seed of the random numbers").get_or<unsigned long>("seed", 1);
  double rows = double(sweep.samples);
  for (const SweptValue& value : sweep.values) rows *= double(value.steps);
  if (rows > double(kMostRows)) {
    file.problem("samples", "samples and grid make " + io::with_digits(rows, 4) + " rows, expected at most " +
                                std::to_string(kMostRows));
  }
}

void read_shown(Section& file, SceneSweep& sweep, bool known) {
  const std::vector<std::string> fallback = {"most.v", "energy.kinetic"};
  file.about("columns of the results that are plotted against the varied numbers");
  if (!known) return file.defer("plot", "names", "\"most.v energy.kinetic\"");
  sweep.shown = file.strings_or("plot", fallback, result_names(sweep.scene));
}

void read_sweep_keys(Section& file, SceneSweep& sweep, bool known) {
  read_values(file, sweep, known);
  read_counts(file, sweep);
  read_shown(file, sweep, known);
  const EvaluationKeys keys = read_evaluation(file, PointsAtOnce::kSamples);
  sweep.evaluation = keys.options;
  sweep.threads = keys.threads;
}

std::string read_sweep_name(Section& file, const std::string& fallback) {
  return file.about("name of the sweep in reports and pictures").get_or<std::string>("name", fallback);
}

}  // namespace

SceneSweep read_sweep_text(const std::string& text, const std::string& path,
                           const std::vector<io::Setting>& settings) {
  check_is_no_robot(text, path, "a sweep; expected an .info file, as those in config/sweeps");
  check_file_kind(text, path, FileKind::kSweep);
  Section file = Section::parse(text, path, old_names(), settings);
  SceneSweep sweep;
  sweep.file = path;
  sweep.name = read_sweep_name(file, std::filesystem::path(path).stem().string());
  const bool known = take_swept_scene(file, sweep);
  read_sweep_keys(file, sweep, known);
  file.finish();
  note_old_names(sweep.scene.notes, file);
  sweep.effective = file.effective_values();
  sweep.inputs = file.files();
  sweep.inputs.insert(sweep.inputs.end(), sweep.scene.inputs.begin(), sweep.scene.inputs.end());
  return sweep;
}

SceneSweep read_sweep(const std::string& path, const std::vector<io::Setting>& settings) {
  return read_sweep_text(read_file(path), path, settings);
}

std::vector<io::Question> sweep_questions() {
  Section file = Section::catalogue();
  SceneSweep sweep;
  read_sweep_name(file, "its file's");
  file.about("path of the scene or task whose numbers vary, relative to the folder of this file")
      .get<std::string>("scene");
  read_sweep_keys(file, sweep, false);
  return file.questions();
}

std::vector<std::string> result_names(const Scene& scene) {
  std::vector<std::string> names = {"t"};
  for (const char* block : {"q", "v"}) {
    for (const std::string& name : entry_names(scene.robot.model, block)) names.push_back(name);
  }
  names.insert(names.end(), {"energy.kinetic", "energy.stored", "most.energy", "most.v"});
  return names;
}

std::vector<std::string> row_names(const SceneSweep& sweep) {
  std::vector<std::string> names = {"sample"};
  for (const SweptValue& value : sweep.values) names.push_back(value.name);
  names.emplace_back("ok");
  for (const std::string& name : result_names(sweep.scene)) names.push_back(name);
  return names;
}

}  // namespace dyntape
