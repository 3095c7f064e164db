// SPDX-License-Identifier: BSD-3-Clause
#include "commands.h"
#include "words.h"

namespace dyntape::tools {

void add_robot_options(CLI::App& command, RobotOptions& options) {
  add_path(command, "robot", options.path, "the robot, a URDF file", "ROBOT.urdf")->required();
  add_choice(command, "--base", options.base,
             "fixed: the root link is the world; floating: a free-flyer carries it", {"fixed", "floating"})
      ->capture_default_str();
  command.add_option("--lock", options.lock, "joints held at their neutral position, separated by commas")
      ->delimiter(',')
      ->type_name("J1,J2");
  command
      .add_option("--snap", options.snap,
                  "rotations closer than this angle [rad] to a multiple of 90 degrees are made exact; 0: off")
      ->type_name("RAD")
      ->capture_default_str();
  command.add_flag("--mimic", options.mimic,
                   "joints with <mimic> follow their leader; they have no entries in q and v");
  add_choice(command, "--inertia", options.inertia,
             "a physically impossible inertia (a negative principal moment) is an error, or only a warning",
             {"error", "warn"})
      ->capture_default_str();
}

dynamics::UrdfRobot load_robot(const RobotOptions& options) {
  dynamics::UrdfOptions urdf;
  urdf.base = options.base == "floating" ? dynamics::Base::kFloating : dynamics::Base::kFixed;
  urdf.lock = options.lock;
  urdf.snap = options.snap;
  urdf.mimic = options.mimic;
  urdf.accept_nonphysical_inertia = options.inertia == "warn";
  return dynamics::read_urdf(options.path, urdf);
}

void add_settings(CLI::App& command, std::vector<std::string>& set) {
  command
      .add_option(
          "--set", set,
          "set a key of the file to a value; may be repeated: --set effects.gravity=off --set start.q=0.5")
      ->allow_extra_args(false)
      ->check(not_empty())
      ->type_name("KEY.PATH=VALUE");
}

std::vector<std::string> numbered(const std::string& prefix, int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(prefix + std::to_string(i));
  return names;
}

}  // namespace dyntape::tools
