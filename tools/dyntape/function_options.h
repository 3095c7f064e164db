// SPDX-License-Identifier: BSD-3-Clause
//
// --function and what goes with it, for every command that takes a function of a robot.
#pragma once

#include <dyntape/interface/robot/robot_functions.h>

#include "commands.h"

namespace dyntape::tools {

struct FunctionOptions {
  std::string name, frame, in = "aligned";
  std::vector<std::string> contacts;
};

// `purpose`: what the help says of --function.  The help ends with the table of functions.
CLI::Option* add_function_options(CLI::App& command, FunctionOptions& options, const std::string& purpose);

// The function of that name with the frame and contacts chosen, and the robot's followers.
RobotFunction chosen(const std::string& name, const FunctionOptions& options,
                     const dynamics::UrdfRobot& robot);

// ArgumentError, with what follows from it, for a robot without a joint that moves.
void check_moves(const dynamics::UrdfRobot& robot, const std::string& consequence);

}  // namespace dyntape::tools
