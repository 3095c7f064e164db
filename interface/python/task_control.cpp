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
#include "scenes.h"
#include "watch.h"

namespace dyntape::python {
namespace {

struct PythonLoop {
  Task task;
  ControlReport report;
};

std::shared_ptr<PythonLoop> control(const std::filesystem::path& file, nb::handle set, nb::handle progress) {
  const std::vector<io::Setting> settings = settings_from(set);
  auto loop = std::make_shared<PythonLoop>();
  loop->task = read_task(file.string(), settings);
  loop->report = watched(progress, [&](const Watch& watch) {
    const auto tell = [&](double t) {
      if (watch.tell) watch.tell("t = " + io::with_digits(t, 4) + " s");
    };
    return control_task(loop->task, watch.stop, tell);
  });
  return loop;
}

std::vector<std::string> write_loop_files(PythonLoop& loop, const std::filesystem::path& folder) {
  const nb::gil_scoped_release unlocked;
  std::filesystem::create_directories(folder);
  write_control(loop.task, loop.report, folder.string());
  return loop.report.unwritten;
}

nb::object steps_of(const PythonLoop& loop) {
  Eigen::VectorXd seconds(static_cast<Eigen::Index>(loop.report.loop.steps.size()));
  for (Eigen::Index k = 0; k < seconds.size(); ++k)
    seconds[k] = loop.report.loop.steps[std::size_t(k)].seconds;
  return copy_of(seconds.data(), {seconds.size()});
}

}  // namespace

void bind_task_control(nb::module_& module) {
  using L = PythonLoop;
  const auto rows = [](const Eigen::MatrixXd& m) { return copy_of(m.data(), {m.cols(), m.rows()}); };
  nb::class_<L>(module, "ClosedLoop", "A controller and the plant that it steered.")
      .def_prop_ro(
          "t",
          [](const L& l) { return copy_of(l.report.loop.motion.t.data(), {l.report.loop.motion.t.size()}); },
          nb::sig("def t(self) -> Array"), "(points,) s.")
      .def_prop_ro(
          "x", [rows](const L& l) { return rows(l.report.loop.motion.x); }, nb::sig("def x(self) -> Array"),
          "(points, states) of the plant.")
      .def_prop_ro(
          "u", [rows](const L& l) { return rows(l.report.loop.motion.u); }, nb::sig("def u(self) -> Array"),
          "(points, controls) that acted.")
      .def_prop_ro("step_seconds", steps_of, nb::sig("def step_seconds(self) -> Array"),
                   "(steps,) of planning.")
      .def_prop_ro(
          "success", [](const L& l) { return l.report.success(); },
          "Whether every plan was usable and came in time.")
      .def_prop_ro(
          "json", [](const L& l) { return l.report.json(); }, "The report for programs.")
      .def(
          "text", [](const L& l) { return l.report.text(); }, "The report for people.")
      .def("write", write_loop_files, nb::arg("folder"),
           nb::sig("def write(self, folder: str | os.PathLike[str]) -> list[str]"),
           "closed_loop.csv, report.json, pictures and motion.html; returns a sentence for each that could "
           "not be written.")
      .def(
          "plot", [](nb::handle self) { return pictures_of(self); }, nb::sig("def plot(self) -> Pictures"),
          "The pictures that `write` makes, by name, as SVG.\n\nRaises RuntimeError where gnuplot is not "
          "installed.")
      .def("__repr__", [](const L& l) {
        return "<dyntape.ClosedLoop of \"" + l.report.task +
               "\": " + std::to_string(l.report.loop.steps.size()) + " steps, " +
               (l.report.success() ? "every plan usable and in time" : "not every plan usable and in time") +
               ">";
      });
  module.def(
      "control", control, nb::arg("task"), nb::kw_only(), nb::arg("set") = nb::none(),
      nb::arg("progress") = nb::none(),
      nb::sig("def control(task: str | os.PathLike[str], *, set: Mapping[str, Any] | None = None, "
              "progress: Progress = None) -> ClosedLoop"),
      "A task file with a block `mpc` as a controller, in closed loop with its own model.\n\n"
      "set: values in place of what the file says.  progress: is told the time.  Ctrl-C stops it.\n\n"
      "Raises FileError for what is wrong in the file, ArgumentError for a task without costs of tracking.");
}

}  // namespace dyntape::python
