// SPDX-License-Identifier: BSD-3-Clause
//
// The command line in this process: python -m dyntape.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <iostream>
#include <string>
#include <vector>

#include "module.h"
#include "program.h"

namespace dyntape::python {
namespace {

int command_line(std::vector<std::string> arguments) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const nb::gil_scoped_release unlocked;
  const int status = tools::command_line(static_cast<int>(arguments.size()), argv.data());
  std::cout << std::flush;
  return status;
}

}  // namespace

void bind_commands(nb::module_& module) {
  module.def(
      "command_line", command_line, nb::arg("arguments"),
      "What the command `dyntape` does with these arguments, its name first; returns its exit status.\n\n"
      "For a process of its own: it takes signals and the standard streams.");
}

}  // namespace dyntape::python
