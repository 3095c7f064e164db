// SPDX-License-Identifier: BSD-3-Clause
//
// The extension module that the package `dyntape` is made of, and the command line in its process: python -m dyntape.
#include "module.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <iostream>
#include <string>
#include <vector>

#include "arrays.h"
#include "program.h"
#include "watch.h"

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

struct LeftAlone {
  nb::object owner;
  std::function<bool(std::chrono::milliseconds)> is_done;
};
std::vector<LeftAlone>& all_left_alone() {
  static std::vector<LeftAlone> all;
  return all;
}

// While the interpreter still can release what the work uses.
void wait_for_all_left_alone() {
  for (const LeftAlone& work : all_left_alone()) {
    const nb::gil_scoped_release unlocked;
    while (!work.is_done(std::chrono::hours(1))) {
    }
  }
  all_left_alone().clear();
}

}  // namespace

void keep_until_done(nb::object owner, std::function<bool(std::chrono::milliseconds)> is_done) {
  std::erase_if(all_left_alone(), [](const LeftAlone& work) { return work.is_done({}); });
  all_left_alone().push_back({std::move(owner), std::move(is_done)});
}

}  // namespace dyntape::python

NB_MODULE(_dyntape, module) {
  using namespace dyntape::python;
  // An exception that something keeps to the end, as pytest does, keeps what was recorded; that is no fault of a caller's.
  nb::set_leak_warnings(false);
  import_numpy();
  bind_errors(module);
  bind_recorded_values(module);
  bind_functions(module);
  bind_robot(module);
  bind_scenes(module);
  bind_tasks(module);
  bind_problems(module);
  bind_task_control(module);
  bind_sweeps(module);
  bind_sweep_chunks(module);
  bind_identification(module);
  bind_quadratic(module);
  module.def(
      "command_line", command_line, nb::arg("arguments"),
      "What the command `dyntape` does with these arguments, its name first; returns its exit status.\n\n"
      "For a process of its own: it takes signals and the standard streams.");
  nb::module_::import_("atexit").attr("register")(nb::cpp_function(wait_for_all_left_alone));
  module.attr("__version__") = DYNTAPE_VERSION;
  rewrite_argument_errors(module);
}
