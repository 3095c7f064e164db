// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.Task and dyntape.solve: a task file to a verified motion.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/task/curves.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/solve/pictures.h>
#include <dyntape/interface/run/solve/solve.h>

#include "module.h"
#include "scenes.h"
#include "watch.h"

namespace dyntape::python {
namespace {

struct PythonTask {
  explicit PythonTask(Task read) : task(std::move(read)) {}
  const Task task;
};

struct TaskSolution {
  std::shared_ptr<const PythonTask> task;
  SolveReport report;

  const Trajectory& motion() const { return report.solution.motion; }
  Curves curves() const { return curves_of(task->task, motion()); }
};

Task task_in_file(const std::filesystem::path& file, nb::handle set) {
  const std::vector<io::Setting> settings = settings_from(set);
  const nb::gil_scoped_release unlocked;
  return read_task(file.string(), settings);
}

std::shared_ptr<TaskSolution> solved(std::shared_ptr<PythonTask> task, nb::handle progress) {
  SolveReport report = watched(progress, [&](const Watch& watch) {
    const auto tell = [&](const SolveMoment& moment) {
      if (watch.tell) watch.tell(moment.text());
    };
    return solve_task(task->task, {watch.stop, tell});
  });
  return std::shared_ptr<TaskSolution>(new TaskSolution{task, std::move(report)});
}

std::shared_ptr<TaskSolution> solve_file(nb::handle given, nb::handle set, nb::handle progress) {
  if (!nb::isinstance<PythonTask>(given))
    return solved(std::make_shared<PythonTask>(task_in_file(nb::cast<std::filesystem::path>(given), set)),
                  progress);
  if (!set.is_none()) throw ArgumentError("solve: set is for files; a Task was read with its own");
  return solved(nb::cast<std::shared_ptr<PythonTask>>(given), progress);
}

// (points, entries) of a matrix with a point a column, as numpy has it.
nb::object points_of(const Eigen::MatrixXd& columns) {
  return copy_of(columns.data(), {columns.cols(), columns.rows()});
}

std::vector<std::string> write(TaskSolution& s, const std::filesystem::path& folder) {
  const nb::gil_scoped_release unlocked;
  std::filesystem::create_directories(folder);
  write_results(s.task->task, s.report, folder.string());
  return s.report.unwritten;
}

std::string page(const TaskSolution& s) {
  const nb::gil_scoped_release unlocked;
  return player_page(motion_player(s.task->task, s.motion()));
}

// What serves what, by name: of a task's curves.
void bind_curves(nb::class_<TaskSolution>& type) {
  using S = TaskSolution;
  const auto curve = [&](const char* name, Eigen::MatrixXd Curves::*which, const char* what) {
    type.def_prop_ro(
        name, [which](const S& s) { return points_of(s.curves().*which); },
        nb::sig(kept(std::string("def ") + name + "(self) -> Array")), what);
  };
  curve("q", &Curves::q, "(points, nq).");
  curve("v", &Curves::v, "(points, nv).");
  curve("a", &Curves::a, "(points, nv).");
  curve("tau", &Curves::tau, "(points, controls) torques of the driven joints, N m or N, then other forces.");
}

void bind_solution(nb::module_& module) {
  using S = TaskSolution;
  nb::class_<S> type(module, "TaskSolution",
                     "What came of a task: the motion, verified, and what to say of it.");
  type.def_prop_ro(
          "t", [](const S& s) { return copy_of(s.motion().t.data(), {s.motion().t.size()}); },
          nb::sig("def t(self) -> Array"), "(points,) s.")
      .def_prop_ro(
          "x", [](const S& s) { return points_of(s.motion().x); }, nb::sig("def x(self) -> Array"),
          "(points, states), as `states` names them.")
      .def_prop_ro(
          "u", [](const S& s) { return points_of(s.motion().u); }, nb::sig("def u(self) -> Array"),
          "(points, controls), as `controls` names them, in the unit of the task.")
      .def_prop_ro(
          "states", [](const S& s) { return s.task->task.problem.states; }, "Names of the states.")
      .def_prop_ro(
          "controls", [](const S& s) { return s.task->task.problem.controls; }, "Names of the controls.")
      .def_prop_ro(
          "cost", [](const S& s) { return s.report.solution.cost(); }, "What was minimised.")
      .def_prop_ro(
          "duration", [](const S& s) { return s.report.duration(); }, "s.")
      .def_prop_ro(
          "iterations", [](const S& s) { return s.report.iterations(); }, "On all meshes.")
      .def_prop_ro(
          "violation", [](const S& s) { return s.report.solution.verification.violation; },
          "Most that a constraint is broken by, computed anew, relative to nominal values.")
      .def_prop_ro(
          "true_defect", [](const S& s) { return s.report.solution.verification.worst_defect; },
          "Most that an interval differs from its re-simulation.")
      .def_prop_ro(
          "success", [](const S& s) { return s.report.success(); },
          "The whole verdict: solved, feasible, optimal, true, within limits.")
      .def_prop_ro(
          "verdict", [](const S& s) { return s.report.verdict(); }, "One sentence.")
      .def_prop_ro(
          "notes", [](const S& s) { return s.report.notes; },
          "What was odd in the robot's file or with the guess.")
      .def_prop_ro(
          "json", [](const S& s) { return s.report.json(); }, "The report for programs.")
      .def(
          "text", [](const S& s) { return s.report.text(); }, "The report for people.")
      .def("write", write, nb::arg("folder"),
           nb::sig("def write(self, folder: str | os.PathLike[str]) -> list[str]"),
           "trajectory.csv, iterations.csv, report.json, effective.info, pictures and motion.html; returns a "
           "sentence\n"
           "for each that could not be written.")
      .def("page", page, "The motion in 3D, an HTML page.")
      .def(
          "_repr_html_", [](const S& s) { return in_notebook(page(s)); },
          "The page, within that of a notebook.")
      .def(
          "plot", [](nb::handle self) { return pictures_of(self); }, nb::sig("def plot(self) -> Pictures"),
          "The pictures that `write` makes, by name, as SVG; a notebook shows them.\n\n"
          "Raises RuntimeError where gnuplot is not installed.")
      .def("__repr__", [](const S& s) {
        return "<dyntape.TaskSolution of \"" + s.task->task.name + "\": " + s.report.verdict() + ", cost " +
               io::with_digits(s.report.solution.cost(), 6) + ", " + std::to_string(s.motion().points()) +
               " points>";
      });
  bind_curves(type);
}

void bind_task(nb::module_& module) {
  using T = PythonTask;
  nb::class_<T>(
      module, "Task",
      "A robot, what acts on it, where it shall go and what that shall cost: an .info file, read.\n\n"
      "Raises FileError with a line for every problem of the file.")
      .def(
          "__init__",
          [](T* self, const std::filesystem::path& file, nb::handle set) {
            new (self) T(task_in_file(file, set));
          },
          nb::arg("file"), nb::kw_only(), nb::arg("set") = nb::none(),
          nb::sig("def __init__(self, file: str | os.PathLike[str], *, set: Mapping[str, Any] | None = None) "
                  "-> None"))
      .def_prop_ro(
          "name", [](const T& t) { return t.task.name; }, "Its name.")
      .def_prop_ro(
          "notes", [](const T& t) { return t.task.notes; },
          "What is odd in the robot's file or with the guess.")
      .def_prop_ro(
          "effective", [](const T& t) { return t.task.effective; },
          "The file as it was understood, defaults included.")
      .def(
          "explain", [](const T& t) { return explain(t.task); },
          "What is recorded: the resolved scene, each effect with the operations it adds, sizes.  Solves "
          "nothing.")
      .def("solve", solved, nb::kw_only(), nb::arg("progress") = nb::none(),
           nb::sig("def solve(self, *, progress: Progress = None) -> TaskSolution"),
           "Solves and verifies.  progress: is told in words how far it is.  Ctrl-C stops it.")
      .def("__repr__", [](const T& t) {
        return "<dyntape.Task \"" + t.task.name + "\": robot \"" + t.task.scene.model.name + "\", " +
               std::to_string(t.task.problem.n_x()) + " states, " + std::to_string(t.task.problem.n_u()) +
               " controls>";
      });
}

}  // namespace

void bind_tasks(nb::module_& module) {
  bind_solution(module);
  bind_task(module);
  module.def(
      "solve", solve_file, nb::arg("task"), nb::kw_only(), nb::arg("set") = nb::none(),
      nb::arg("progress") = nb::none(),
      nb::sig("def solve(task: str | os.PathLike[str] | Task, *, set: Mapping[str, Any] | None = None, "
              "progress: Progress = None) -> TaskSolution"),
      "Solves a task file or Task and verifies the motion.\n\n"
      "set: values in place of what the file says, by key path: {\"horizon.intervals\": 60}.\n"
      "progress: is told in words how far it is, `print` for one; True shows a line.  Ctrl-C stops it.\n\n"
      "Raises FileError for what is wrong in the file.  A solve that fails is no error: see `success` and\n"
      "`verdict`.");
}

}  // namespace dyntape::python
