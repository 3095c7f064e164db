// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape generate TASK --controller DIR: a task's controller as one C file (interface/control/printed/controller.h).
#pragma once

#include <string>
#include <vector>

#include "../commands.h"

namespace dyntape::tools {

struct ControllerCommand {
  std::string task, output, cross;
  std::vector<std::string> set;
  bool single = false, json = false;
  int iterations = 50;
  std::size_t target_bytes = 0;
};

// Adds --controller, --iterations, --target-bytes and --set.
CLI::Option* add_controller_options(CLI::App& command, ControllerCommand& options);
void run_controller(const ControllerCommand& options);

// The compiler and flags of --cross, or "gcc".
std::vector<std::string> cross_words(const std::string& cross);

}  // namespace dyntape::tools
