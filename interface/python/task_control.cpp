// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.control: a task file as a controller in closed loop with its own model.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include <filesystem>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/mpc/mpc_task.h>

#include "module.h"
#include "motions.h"
#include "watch.h"

namespace dyntape::python {
namespace {

struct PythonLoop {
  Task task;
  ControlReport report;
};

std::shared_ptr<PythonLoop> control(const std::filesystem::path& file, nb::handle set, nb::handle progress) {
  auto loop = std::make_shared<PythonLoop>();
  loop->task = read_with(read_task, file, set);
  loop->report = watched(progress, [&](const Watch& watch) {
    const auto tell = [&](double t) {
      if (watch.tell) watch.tell("t = " + io::with_digits(t, 4) + " s");
    };
    return control_task(loop->task, watch.stop, tell);
  });
  return loop;
}

nb::object steps_of(const PythonLoop& loop) {
  Eigen::VectorXd seconds(static_cast<Eigen::Index>(loop.report.loop.steps.size()));
  for (Eigen::Index k = 0; k < seconds.size(); ++k)
    seconds[k] = loop.report.loop.steps[std::size_t(k)].seconds;
  return entries_of(seconds);
}

}  // namespace

void bind_task_control(nb::module_& module) {
  using L = PythonLoop;
  nb::class_<L> type(module, "ClosedLoop", "A controller and the plant that it steered.");
  def_array(type, "t", "(points,) s.", [](const L& l) { return entries_of(l.report.loop.motion.t); });
  def_array(type, "x", "(points, states) of the plant.",
            [](const L& l) { return rows_of(l.report.loop.motion.x); });
  def_array(type, "u", "(points, controls) that acted.",
            [](const L& l) { return rows_of(l.report.loop.motion.u); });
  def_array(type, "step_seconds", "(steps,) of planning.", steps_of);
  def_report(type, "Whether every plan was usable and came in time.");
  def_files(
      type, [](L& l, const std::string& folder) { write_control(l.task, l.report, folder); },
      "closed_loop.csv, report.json");
  type.def("__repr__", [](const L& l) {
    return "<dyntape.ClosedLoop of \"" + l.report.task + "\": " + std::to_string(l.report.loop.steps.size()) +
           " steps, " +
           (l.report.success() ? "every plan usable and in time" : "not every plan usable and in time") + ">";
  });
  module.def(
      "control", control, nb::arg("task"), nb::kw_only(), nb::arg("set") = nb::none(),
      nb::arg("progress") = nb::none(),
      nb::sig("def control(task: str | os.PathLike[str], *, set: Mapping[str, Any] | None = None, "
              "progress: Progress = None) -> ClosedLoop"),
      "A task file with a block `mpc` as a controller, in closed loop with its own model.\n"
      "\n"
      "set: values for keys of the file, by key path.  progress: a function that gets sentences about the "
      "progress.  Ctrl-C stops it.\n"
      "\n"
      "Raises FileError for mistakes in the file, ArgumentError for a task without costs of tracking.");
}

}  // namespace dyntape::python
