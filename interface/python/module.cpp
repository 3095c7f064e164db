// SPDX-License-Identifier: BSD-3-Clause
//
// The extension module that the package `dyntape` is made of.
#include "module.h"

#include "arrays.h"

NB_MODULE(_dyntape, module) {
  using namespace dyntape::python;
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
  bind_identification(module);
  bind_commands(module);
  module.attr("__version__") = DYNTAPE_VERSION;
}
