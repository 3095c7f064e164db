// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape check-config: the problems of a task, scene or sweep file, and every key that one may have, by the code that reads them.
#include <iostream>
#include <memory>
#include <set>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/old_names.h>
#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/files/scene/start_notes.h>
#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/simulate/simulate.h>

#include "commands.h"
#include "help.h"
#include "words.h"

namespace dyntape::tools {
namespace {

std::string owner_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}

// "a number, positive; default 1e-08"
std::string what_it_takes(const io::Question& q) {
  if (q.is_required) return q.takes + "; required";
  return q.fallback.empty() ? q.takes : q.takes + "; default " + q.fallback;
}

// The keys of one block, each followed by its own.
std::string keys_of(const std::vector<io::Question>& questions, const std::string& block, std::size_t depth) {
  std::string text;
  for (const io::Question& q : questions) {
    if (owner_of(q.path) != block) continue;
    const std::string key = q.path.substr(block.empty() ? 0 : block.size() + 1);
    if (depth == 0) text += "\n";
    text += help_entry(std::string(2 * depth, ' ') + key, q.meaning + " (" + what_it_takes(q) + ")");
    text += keys_of(questions, q.path, depth + 1);
  }
  return text;
}

std::string introduction(const std::string& kind) {
  return "Keys of a " + kind +
         " file.  Keys of a block are indented.  A key with a number per joint takes a block that names\n"
         "every joint (q { shoulder 0  elbow 1 }), a quoted list in the order of the joints, or one number "
         "for "
         "all joints.\n"
         "Required keys of an optional block are required if the file has the block.\n";
}

struct Found {
  std::string effective, size;
  std::vector<std::string> notes;
};

// Scenes are simulated, in sweeps something varies, tasks have a horizon, some of them of one mass.  What is none of them is for
// the reader of tasks to complain of.
Found found_in(const TextOfFile& file) {
  if (has_block(file, "vary")) {
    SceneSweep sweep = read_sweep_text(file.text, file.path, file.settings);
    return {std::move(sweep.effective),
            "a sweep of " + std::to_string(sweep.rows()) + " samples of " +
                std::to_string(sweep.values.size()) + " values",
            std::move(sweep.scene.notes)};
  }
  if (has_block(file, "simulation")) {
    Scene scene = read_scene_text(file.text, file.path, file.settings);
    check_start(scene);
    const dynamics::Model<double>& model = scene.robot.model;
    std::vector<std::string> notes = notes_of(scene);
    return {std::move(scene.effective),
            "a scene of " + std::to_string(model.nv - int(scene.robot.mimics.size())) +
                " degrees of freedom, " + std::to_string(actuated_dofs(scene.robot).size()) + " driven",
            std::move(notes)};
  }
  if (has_block(file, "centroidal")) {
    CentroidalTask task = centroidal_task_in(file);
    return {std::move(task.effective),
            "one mass of " + io::significant(task.body.mass, 6) + " kg on " +
                std::to_string(task.body.feet.size()) + " feet",
            std::move(task.notes)};
  }
  Task task = task_in(file);
  std::vector<std::string> notes = std::move(task.notes);
  for (const std::string& sentence : unmet_demands(task))
    if (sentence != task.unreachable) notes.push_back(file.path + ": " + sentence);
  return {std::move(task.effective),
          std::to_string(task.problem.n_x()) + " states, " + std::to_string(task.problem.n_u()) + " controls",
          std::move(notes)};
}

// Gives the keys of the file, and of those that it includes, their names of today.
void rename_in(const TextOfFile& file) {
  io::InfoScan scan = io::scan_info(file.text, file.path);
  io::throw_if_any(scan.problems);
  const std::vector<io::Replacement> replacements = io::replace_old_names(scan.root, old_names());
  std::set<std::string> paths;
  for (const io::Replacement& r : replacements) {
    std::cout << to_string(r.where) << ": " << r.was << " -> " << r.now << "\n";
    paths.insert(*r.where.file);
  }
  for (const std::string& path : paths) {
    const std::string text = path == file.path ? file.text : read_file(path);
    write_file_atomically(path, io::replaced(text, path, replacements));
  }
  if (paths.empty()) std::cout << file.path << ": nothing to rename\n";
}

}  // namespace

void add_check_config(CLI::App& app) {
  CLI::App* command = app.add_subcommand("check-config",
                                         "read a task, scene or sweep file and its robot strictly; print "
                                         "every problem with file, line and column");
  const auto file = std::make_shared<std::string>();
  const auto set = std::make_shared<std::vector<std::string>>();
  const auto show = std::make_shared<bool>(false), rename = std::make_shared<bool>(false);
  add_path(*command, "file", *file, "the task, scene or sweep, an .info file", "FILE")->required();
  add_settings(*command, *set);
  command->add_flag("--effective", *show, "print the file with all defaults filled in");
  command->add_flag("--rename", *rename,
                    "replace old names of keys in the file by today's names, and list them");
  command->callback([file, set, show, rename] {
    const TextOfFile text(*file, *set);
    if (*rename && !set->empty())
      throw ArgumentError("--rename changes what the file says: expected it without --set");
    if (*rename) return rename_in(text);
    const Found found = found_in(text);
    if (*show) {
      std::cout << found.effective;
      return;
    }
    std::cout << *file << ": sound (" << found.size << ")\n";
    for (const std::string& note : folded(found.notes)) std::cout << "note: " << note << "\n";
  });
  const auto printing = [](const std::string& kind, std::vector<io::Question> (*questions)()) {
    return [=] {
      std::cout << flowing(introduction(kind)) << keys_of(questions(), "", 0);
      throw CLI::Success();
    };
  };
  command->add_flag_callback("--keys", printing("task", task_questions),
                             "print every key that a task file may have, with unit and default");
  command->add_flag_callback("--centroidal-keys", printing("centroidal", centroidal_questions),
                             "likewise for a file with a block centroidal, for mpc");
  command->add_flag_callback("--scene-keys", printing("scene", scene_questions), "likewise for a scene file");
  command->add_flag_callback("--sweep-keys", printing("sweep", sweep_questions), "likewise for a sweep file");
}

}  // namespace dyntape::tools
