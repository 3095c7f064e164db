// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape simulate: a scene file, or a robot and a few options, to a motion with its energies and pictures.
#include <atomic>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

#include <Eigen/Geometry>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/planar_keys.h>
#include <dyntape/interface/io/live_line.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/simulation_results.h>

#include "commands.h"
#include "interruption.h"
#include "words.h"

namespace dyntape::tools {

namespace {

struct SimulateOptions {
  std::string file, output;
  std::vector<const CLI::Option*> of_robot;
  // Of a robot without a scene file.
  std::string base = "fixed", integrator = "runge-kutta-4";
  std::vector<double> q0, v0;
  std::vector<std::string> effects, lock, set;
  double duration = 1, step = 1e-3;
  bool explain = false, json = false, accuracy = false, mimic = false;
};

// By its name; what comes by a pipe has none, and says by its first character that it is XML.
bool is_robot(const TextOfFile& file) {
  std::error_code none;
  const bool has_name = std::filesystem::is_regular_file(file.path, none);
  if (has_name) return std::filesystem::path(file.path).extension() != ".info";
  const std::size_t first = file.text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return first != file.text.npos && file.text[first] == '<';
}

// "joint_damping=0.1" as a key of a scene's effects.
io::Setting effect_setting(const std::string& option) {
  const std::size_t equals = option.find('=');
  if (equals + 1 == option.size())
    throw ArgumentError("--effects " + option + ": got no value, expected one after '=', or the key alone");
  const std::string key = option.substr(0, equals);
  return {"effects." + key, equals == option.npos ? "on" : option.substr(equals + 1), "--effects " + key};
}

// The scene file that the options stand for.
std::vector<io::Setting> scene_settings(const SimulateOptions& options) {
  const std::filesystem::path robot(options.file);
  if (robot.filename().string().find('"') != std::string::npos)
    throw ArgumentError("the robot's file " + robot.filename().string() +
                        " has a quotation mark in its name, which no scene can hold; rename it");
  std::string lock;
  for (const std::string& joint : options.lock) lock += (lock.empty() ? "" : " ") + joint;
  std::vector<io::Setting> settings = {{"name", robot.stem().string(), "the robot's file"},
                                       {"robot.urdf", robot.filename().string(), "the robot's file"},
                                       {"robot.base", options.base, "--base"},
                                       {"robot.lock", lock, "--lock"}};
  if (options.mimic) settings.push_back({"robot.mimic", "true", "--mimic"});
  for (const std::string& effect : options.effects) settings.push_back(effect_setting(effect));
  settings.push_back({"simulation.duration", io::shortest(options.duration), "--for"});
  settings.push_back({"simulation.step", io::shortest(options.step), "--step"});
  settings.push_back({"simulation.integrator", options.integrator, "--integrator"});
  return settings;
}

// The numbers of an option: all of q or v, or one a joint of one degree of freedom, or one for these.
Eigen::VectorXd spread(const std::vector<double>& given, const RobotScene& robot, const std::string& option,
                       const Eigen::VectorXd& otherwise, bool is_q) {
  const dynamics::Model<double>& model = robot.model;
  if (given.empty()) return otherwise;
  const auto values = Eigen::Map<const Eigen::VectorXd>(given.data(), Eigen::Index(given.size()));
  if (values.size() == otherwise.size()) return values;
  const auto n = Eigen::Index(independent_joints(robot).size());
  if (values.size() != n && values.size() != 1) {
    throw ArgumentError(option + ": got " + std::to_string(given.size()) + " numbers; expected " +
                        std::to_string(otherwise.size()) + ", or " + std::to_string(n) +
                        " of the joints alone, or one for all of these");
  }
  Eigen::VectorXd all = Eigen::VectorXd::Zero(model.nv);
  Eigen::Index k = 0;
  for (const std::string& joint : independent_joints(robot))
    all[model.joints[std::size_t(model.joint_index(joint))].idx_v] = values[values.size() == 1 ? 0 : k++];
  return is_q ? configuration_of(model, all) : all;
}

// A rotation is read by the direction of its numbers, and zeros have none.
void check_rotations(const Eigen::VectorXd& q, const dynamics::Model<double>& model) {
  for (const auto& joint : model.joints) {
    const int linear = joint.type == dynamics::JointType::kFreeFlyer ? 3
                       : joint.type == dynamics::JointType::kPlanar  ? 2
                                                                     : 0;
    const int numbers = dynamics::nq(joint.type) - linear;
    if (numbers == dynamics::nv(joint.type) - linear || !q.segment(joint.idx_q + linear, numbers).isZero(0))
      continue;
    throw ArgumentError(
        "--q0: the " + std::string(numbers == 4 ? "quaternion (x y z w)" : "cosine and sine") + " of \"" +
        joint.name + "\" is zero, which is no rotation; expected numbers of any other length, as " +
        (numbers == 4 ? "0,0,0,1" : "1,0"));
  }
}

std::string quoted(const auto& numbers) {
  std::string text;
  for (double x : numbers) text += (text.empty() ? "" : " ") + io::shortest(x);
  return "\"" + text + "\"\n";
}

// The same state as a scene's `start`.
std::string start_text(const RobotScene& robot, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  const dynamics::Model<double>& model = robot.model;
  std::vector<double> q_joints, v_joints;
  const Eigen::VectorXd from_neutral = dynamics::difference<double>(model, dynamics::neutral(model), q);
  for (const auto& joint : model.joints) {
    if (!dynamics::is_single(joint.type) || rule_of(robot, joint.name)) continue;
    q_joints.push_back(from_neutral[joint.idx_v]);
    v_joints.push_back(v[joint.idx_v]);
  }
  std::string text = "start\n{\n";
  if (!q_joints.empty()) text += "  q " + quoted(q_joints) + "  v " + quoted(v_joints);
  if (floats(model)) {
    const Eigen::Matrix3d R =
        Eigen::Quaterniond(Eigen::Vector4d(q.segment<4>(3))).normalized().toRotationMatrix();
    const Eigen::Vector3d turns(std::atan2(R(2, 1), R(2, 2)),
                                std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
                                std::atan2(R(1, 0), R(0, 0)));
    text += "  base\n  {\n    position " + quoted(Eigen::Vector3d(q.head<3>())) + "    roll_pitch_yaw " +
            quoted(turns) + "    velocity " + quoted(Eigen::Vector3d(v.head<3>())) + "    angular_velocity " +
            quoted(Eigen::Vector3d(v.segment<3>(3))) + "  }\n";
  }
  for (const std::string& name : planar_names(model)) {
    const auto& joint = model.joints[std::size_t(model.joint_index(name))];
    const Eigen::Vector4d at = q.segment<4>(joint.idx_q);
    const Eigen::Vector3d moves = v.segment<3>(joint.idx_v);
    text += "  planar\n  {\n    joint \"" + name + "\"\n    position " +
            quoted(Eigen::Vector2d(at.head<2>())) + "    angle " + io::shortest(std::atan2(at[3], at[2])) +
            "\n    velocity " + quoted(Eigen::Vector2d(moves.head<2>())) + "    angular_velocity " +
            io::shortest(moves[2]) + "\n  }\n";
  }
  return text + "}\n";
}

void check_has_none(const std::vector<const CLI::Option*>& options) {
  for (const CLI::Option* option : options) {
    if (option->count() > 0)
      throw ArgumentError(option->get_name() + " is of a robot without a scene file; a scene says it itself");
  }
}

Scene scene_in(const SimulateOptions& options) {
  const TextOfFile file(options.file, options.set);  // says at once what is wrong with the file itself
  if (!is_robot(file)) {
    check_has_none(options.of_robot);
    return read_scene_text(file.text, file.path, file.settings);
  }
  if (std::error_code none; !std::filesystem::is_regular_file(file.path, none))
    throw FileError(file.path + ": a robot by a pipe can be read once only; expected the name of its file");
  const std::string here = (std::filesystem::path(options.file).parent_path() / "(command line)").string();
  std::vector<io::Setting> settings = scene_settings(options);
  settings.insert(settings.end(), file.settings.begin(), file.settings.end());
  Scene scene = read_scene_text("", here, settings);
  if (options.q0.empty() && options.v0.empty()) return scene;
  const RobotScene robot = scene.robot;
  const Ties ties = ties_of(robot);
  const Eigen::VectorXd q = ties.tied_q(spread(options.q0, robot, "--q0", scene.q, true));
  check_rotations(q, robot.model);
  const Eigen::VectorXd v = ties.tied_v(spread(options.v0, robot, "--v0", scene.v, false));
  scene = read_scene_text(start_text(robot, q, v), here, settings);
  scene.q = q, scene.v = v;  // also of joints that a file has no words for
  return scene;
}

SimulatedMotion watched(const Scene& scene, io::LiveLine& line, const Interruption& interruption,
                        std::atomic<bool>& has_begun) {
  try {
    return simulate(scene, {.stop = interruption.token(),
                            .tell = [&](const std::string& what) { line.show(what); },
                            .begin = [&] { has_begun = true; }});
  } catch (const Error&) {
    line.erase();
    if (!interruption.status()) throw;
    std::cerr << "dyntape: interrupted before the first step\n";
    throw Failure{interruption.status()};
  }
}

void run(const SimulateOptions& options) {
  const Scene scene = scene_in(options);
  if (const std::string fault = fault_of_name(scene.name); !fault.empty())
    throw FileError(options.file + ": the scene has a name that " + fault);
  std::atomic<bool> has_begun = false;
  const Interruption interruption([&] { return !has_begun; });
  if (options.explain) {
    std::cout << explain(scene, interruption.token());
    if (interruption.status()) throw Failure{interruption.status()};
    return;
  }
  const OutputFolder folder(options.output, simulation_files(), scene.inputs);
  io::LiveLine line;
  SimulationReport report{scene, folder.hold([&] { return watched(scene, line, interruption, has_begun); })};
  if (options.accuracy && report.success()) {
    line.show("how accurate it is");
    report.accuracy = accuracy_of(scene, interruption.token());
  }
  line.erase();
  if (!options.output.empty()) write_results(report, options.output, interruption.token());
  print_report(report, options);
  if (!report.success()) std::cerr << "dyntape: " << scene.name << ": " << report.verdict() << "\n";
  for (const std::string& sentence : report.unwritten) std::cerr << "dyntape: " << sentence << "\n";
  if (report.motion.was_stopped) throw Failure{interruption.status()};
  if (!report.success() || !report.unwritten.empty()) throw Failure{};
}

}  // namespace

void add_simulate(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "simulate",
      "simulate a scene: record one step with the effects that the scene chooses, compile and run it, "
      "and\ncheck the energy balance.  The exit status is 0 only if the simulation reached the end; Ctrl-C "
      "writes\nthe motion so far and exits with status 130");
  const auto options = std::make_shared<SimulateOptions>();
  add_path(*command, "scene", options->file, "the scene, an .info file (config/scenes), or a robot",
           "SCENE.info|ROBOT.urdf")
      ->required();
  add_path(*command, "--output", options->output, "folder for motion.csv, report.json and pictures", "DIR");
  command->add_flag(
      "--explain", options->explain,
      "print the complete scene, the effects with their cost, and the expected accuracy; simulate nothing");
  command->add_flag("--accuracy", options->accuracy,
                    "also estimate the error of the final state and whether nearby motions diverge; "
                    "simulates three more times");
  add_settings(*command, options->set);
  command->add_flag("--json", options->json, "print the report as JSON");
  const std::string group = "Of a robot without a scene file";
  add_choice(*command, "--base", options->base,
             "fixed: the root link is the world; floating: it moves freely", {"fixed", "floating"})
      ->capture_default_str()
      ->group(group);
  command->add_option("--lock", options->lock, "joints held at their neutral position, separated by commas")
      ->delimiter(',')
      ->type_name("J1,J2")
      ->group(group);
  command
      ->add_flag("--mimic", options->mimic,
                 "joints with <mimic> follow their leader; --q0 and --v0 of joints are without them")
      ->group(group);
  command
      ->add_option("--q0", options->q0,
                   "initial configuration: all of q, the joints only, or one number for all joints")
      ->delimiter(',')
      ->type_name("X,X,...")
      ->group(group);
  command->add_option("--v0", options->v0, "initial velocity, likewise")
      ->delimiter(',')
      ->type_name("X,X,...")
      ->group(group);
  command->add_option("--for", options->duration, "duration [s]")
      ->type_name("S")
      ->capture_default_str()
      ->group(group);
  command->add_option("--step", options->step, "time step [s]")
      ->type_name("S")
      ->capture_default_str()
      ->group(group);
  command->add_option("--integrator", options->integrator, "integration scheme")
      ->type_name("NAME")
      ->capture_default_str()
      ->group(group);
  command
      ->add_option("--effects", options->effects,
                   "effects, as keys of the block effects of a scene: gravity=off,joint_damping=0.1")
      ->delimiter(',')
      ->type_name("KEY=VALUE,...")
      ->group(group);
  for (const CLI::Option* option : command->get_options()) {
    if (option->get_group() == group) options->of_robot.push_back(option);
  }
  command->callback([options] { run(*options); });
}

}  // namespace dyntape::tools
