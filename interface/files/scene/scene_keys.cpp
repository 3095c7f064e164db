// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/scene/scene_keys.h>

#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/check.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/lists.h>
#include <dyntape/interface/files/scene/effect_keys.h>

namespace dyntape {

namespace {

using io::Section;

struct RobotKeys {
  std::string urdf;
  dynamics::UrdfOptions options;
  bool are_sound = false;  // else the robot that they name is not the one that is meant
};

RobotKeys read_robot_keys(Section& file, Floating floating) {
  using dynamics::Base;
  Section robot = file.about("the robot").child("robot");
  RobotKeys keys;
  dynamics::UrdfOptions& options = keys.options;
  keys.urdf =
      robot.about("path of the URDF file, relative to the folder of this file").get<std::string>("urdf");
  if (floating == Floating::kAllowed) {
    robot.about("fixed: the root link is the world; floating: the root link moves freely");
    options.base =
        robot.choice_or<Base>("base", "fixed", {{"fixed", Base::kFixed}, {"floating", Base::kFloating}});
  } else {
    robot.about("its root link is the world");
    options.base = robot.choice_or<Base>("base", "fixed", {{"fixed", Base::kFixed}});
  }
  options.lock = distinct_names(robot.about("joints that are locked at their neutral position"), "lock");
  options.mimic =
      robot.about("joints with <mimic> in the URDF file follow their leader; false: they are independent")
          .get_or("mimic", false);
  robot.about("rotations closer than this angle to a multiple of 90 degrees are made exact [rad]");
  options.snap = robot.get_or("rotation_tolerance", options.snap, io::between(0, 0.01));
  robot.about("an inertia that is physically impossible is an error, or only a warning");
  options.accept_nonphysical_inertia =
      robot.choice_or<bool>("inertia", "error", {{"error", false}, {"warn", true}});
  options.continuous = dynamics::ContinuousJoint::kAngle;
  if (robot.present() && keys.urdf.empty() && robot.has("urdf"))
    robot.problem("urdf", "'robot.urdf' is empty");
  keys.are_sound = robot.present() && robot.sound();
  return keys;
}

// Of a file that comes by a pipe or the standard input, which stand in no folder of anybody's, the working one.
std::filesystem::path folder_of(const std::string& file) {
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  for (const char* of_streams : {"/dev", "/dev/fd", "/proc/self/fd"})
    if (folder == of_streams) return {};
  return folder;
}

}  // namespace

SceneRobot read_scene_robot(Section& file, const std::string& path, Floating floating) {
  const RobotKeys keys = read_robot_keys(file, floating);
  if (!keys.are_sound) return {};
  Section block = file.child("robot");
  SceneRobot found{path_beside(path, block, "urdf", keys.urdf)};
  try {
    found.robot = dynamics::read_urdf(found.urdf, keys.options);
    for (std::string& note : found.robot->notes)
      if (note.ends_with(dynamics::kReadAsIndependent)) note += "; 'robot.mimic true' has it follow";
    if (found.robot->model.nv > 0) return found;
    block.problem("urdf", "'" + keys.urdf + "' has no joint that moves");
  } catch (const Error& e) {
    block.problem("urdf", e.what());
  }
  return {found.urdf};
}

void check_is_no_robot(std::string_view text, const std::string& path, const std::string& expected) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == text.npos || text[first] != '<') return;
  const char* const kind = text.find("<robot") == text.npos ? "XML" : "a URDF";
  throw FileError(path + " is " + kind + ", not " + expected +
                  " (dyntape info shows "
                  "a robot)");
}

void read_scene_keys(Section& file, RobotScene& scene, const KeyedRobot& robot) {
  const dynamics::Model<double>* const model = robot.model;
  scene.effects = read_effects(file, robot);
  scene.actuated = distinct_names(file.about("joints with a motor; absent: all"), "actuated",
                                  model ? single_joint_names(*model) : std::vector<std::string>{});
  std::erase_if(scene.actuated, [&](const std::string& name) {
    const dynamics::MimicRule* rule = rule_of(scene, name);
    if (rule)
      file.problem("actuated", "joint '" + name + "' follows '" + rule->leader +
                                   "', whose motor moves it; expected '" + rule->leader + "'");
    return rule != nullptr;
  });
}

std::string path_beside(const std::string& file, Section& block, const std::string& key,
                        const std::string& name) {
  const std::filesystem::path path = (folder_of(file) / name).lexically_normal();
  block.note_file(path.string());
  block.understood_as(key, std::filesystem::absolute(path).lexically_normal().string());
  return path.string();
}

EvaluationKeys read_evaluation(Section& file, PointsAtOnce points) {
  Section block = file.about("how functions are compiled and evaluated").child_or_empty("evaluation");
  EvaluationKeys keys;
  keys.options.route = block
                           .about(
                               "automatic: compiled C if there is a compiler (`solve` uses machine code "
                               "until the compiler has finished); compiled: waits for the compiler; "
                               "machine_code: generated without a compiler; interpreter: evaluates the graph")
                           .choice_or<Route>("route", "automatic",
                                             {{"automatic", Route::kAutomatic},
                                              {"compiled", Route::kCompiled},
                                              {"machine_code", Route::kMachineCode},
                                              {"interpreter", Route::kInterpreter}});
  if (points != PointsAtOnce::kSamples)
    keys.options.functions =
        block
            .about(
                "elementary functions: sines: dyntape's sine and cosine, the C library's others; libm: all "
                "of the C library; portable: the same bits on every processor, fastest in lanes")
            .choice_or<Functions>("functions", to_string(kDefaultFunctions),
                                  {{"sines", Functions::kSines},
                                   {"libm", Functions::kLibm},
                                   {"portable", Functions::kPortable}});
  if (points == PointsAtOnce::kOne) return keys;
  keys.options.lanes =
      block.about("native: several points per SIMD instruction; longer to compile, several times as fast")
          .choice_or<Lanes>("lanes", "none", {{"none", Lanes::kNone}, {"native", Lanes::kNative}});
  block.about("number of threads; 0: one per core");
  keys.threads = static_cast<unsigned>(block.get_or("threads", 1, io::between(0, 1024)));
  return keys;
}

}  // namespace dyntape
