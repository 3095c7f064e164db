// SPDX-License-Identifier: BSD-3-Clause
//
// A task file to what it says: the robot, and all keys (task_keys.cpp).
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/file_kind.h>
#include <dyntape/interface/files/old_names.h>
#include <dyntape/interface/files/scene/left_out.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/scene/scene_keys.h>
#include <dyntape/interface/files/task/task_keys.h>

namespace dyntape {

using io::Section;

namespace {

// What a scene file says, for a problem that is solved.
bool take_scene(Section& file, TaskSpec& task, const std::string& name) {
  for (const char* key : {"robot", "effects", "actuated"}) {
    if (file.has(key))
      file.problem(key,
                   std::string("'") + key + "' stands here and in the scene '" + name + "'; expected one");
  }
  try {
    const auto simulated =
        std::make_shared<const Scene>(read_scene(path_beside(task.file, file, "scene", name)));
    task.urdf = simulated->urdf;
    task.inputs = simulated->inputs;
    task.notes = simulated->notes;
    task.left_out = simulated->left_out;
    task.scene = simulated->robot;
    if (task.scene.lag.size() > 0)
      file.problem("scene", "'" + name + "' has motors with a lag, which only simulate knows");
    if (!task.scene.constraints.rigid.empty()) task.simulated = simulated;
    try {
      check_implicit_contacts(task.scene);
    } catch (const ArgumentError& e) {
      file.problem("scene", "'" + name + "': " + e.what());
    }
    return true;
  } catch (const Error& e) {
    file.problem("scene", e.what());
    return false;
  }
}

}  // namespace

bool read_task_scene(Section& file, TaskSpec& task) {
  file.about("path of a scene file that gives robot, effects and actuated, in place of these keys");
  if (const std::string name = file.get_or("scene", ""); !name.empty()) return take_scene(file, task, name);
  const bool known = take_robot(read_scene_robot(file, task.file, Floating::kAllowed), task, task.scene);
  read_scene_keys(file, task.scene, {known ? &task.scene.model : nullptr, task.urdf, &task.left_out});
  return known;
}

std::string read_task_name(Section& file, const std::string& fallback) {
  return file.about("name of the task in reports and pictures").get_or<std::string>("name", fallback);
}

TaskSpec read_task_file(const std::string& text, const std::string& path,
                        const std::vector<io::Setting>& settings) {
  check_is_no_robot(text, path,
                    "a task file; expected an .info file that names its robot, as those in config/tasks do");
  check_file_kind(text, path, FileKind::kTask);
  Section file = Section::parse(text, path, old_names(), settings);
  TaskSpec task;
  task.file = path;
  task.name = read_task_name(file, std::filesystem::path(path).stem().string());
  const bool known = read_task_scene(file, task);
  read_task_keys(file, task, known ? &task.scene.model : nullptr);
  file.finish();
  task.places = file.places();
  note_left_out(task.notes, task.urdf, task.left_out, task.scene, LimitsOfFile::kHeld);
  note_old_names(task.notes, file);
  task.effective = file.effective_values();
  task.inputs.insert(task.inputs.end(), file.files().begin(), file.files().end());
  return task;
}

}  // namespace dyntape
