// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.Task and dyntape.solve: a task file to a verified motion.
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/solve/curves.h>
#include <dyntape/interface/run/solve/pictures.h>
#include <dyntape/interface/run/solve/solve.h>

#include "module.h"
#include "motions.h"
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

std::shared_ptr<TaskSolution> solved(std::shared_ptr<PythonTask> task, nb::handle progress) {
  for (const std::string& sentence : unmet_demands(task->task))
    if (PyErr_WarnEx(PyExc_UserWarning, sentence.c_str(), 1) < 0) nb::raise_python_error();
  SolveReport report = watched(progress, [&](const Watch& watch) {
    const auto tell = [&](const SolveMoment& moment) {
      if (watch.tell) watch.tell(moment.text());
    };
    return solve_task(task->task, {watch.stop, tell});
  });
  return std::shared_ptr<TaskSolution>(new TaskSolution{task, std::move(report)});
}

std::shared_ptr<TaskSolution> solve_file(nb::handle task, nb::handle set, nb::handle progress) {
  return solved(given_or_read<PythonTask>(read_task, task, set, "solve"), progress);
}

std::string page(const TaskSolution& s) { return player_page(motion_player(s.task->task, s.motion())); }

void bind_arrays(nb::class_<TaskSolution>& type) {
  using S = TaskSolution;
  def_array(type, "t", "(points,) s.", [](const S& s) { return entries_of(s.motion().t); });
  def_array(type, "x", "(points, states), as `states` names them.",
            [](const S& s) { return rows_of(s.motion().x); });
  def_array(type, "u", "(points, controls), as `controls` names them, in the unit of the task.",
            [](const S& s) { return rows_of(s.motion().u); });
  const auto curve = [&](const char* name, Eigen::MatrixXd Curves::*which, const char* what) {
    def_array(type, name, what, [which](const S& s) { return rows_of(s.curves().*which); });
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
  bind_arrays(type);
  def_report(type, "The whole verdict: solved, feasible, optimal, true, within limits.");
  def_page(type, page);
  def_files(
      type, [](S& s, const std::string& folder) { write_results(s.task->task, s.report, folder); },
      "trajectory.csv, iterations.csv, report.json, effective.info");
  type.def_prop_ro(
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
          "verdict", [](const S& s) { return s.report.verdict(); }, "One sentence.")
      .def_prop_ro(
          "notes", [](const S& s) { return s.report.notes; },
          "What was odd in the robot's file or with the guess.")
      .def("__repr__", [](const S& s) {
        return "<dyntape.TaskSolution of \"" + s.task->task.name + "\": " + s.report.verdict() + ", cost " +
               io::with_digits(s.report.solution.cost(), 6) + ", " + std::to_string(s.motion().points()) +
               " points>";
      });
}

void bind_task(nb::module_& module) {
  using T = PythonTask;
  nb::class_<T> type(
      module, "Task",
      "A robot, what acts on it, where it shall go and what that shall cost: an .info file, read.\n\n"
      "Raises FileError with a line for every problem of the file.");
  def_read(type, read_task);
  type.def_prop_ro(
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
           "Solves and verifies.  progress: a function that gets sentences about the progress.  Ctrl-C stops "
           "it.")
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
      "Solves a task file or Task and verifies the motion.\n"
      "\n"
      "set: values for keys of the file, by key path: {\"horizon.intervals\": 60}.\n"
      "progress: a function that gets sentences about the progress, e.g. `print`; True shows a line.  Ctrl-C "
      "stops it.\n"
      "\n"
      "Raises FileError for mistakes in the file.  A solve that fails is no error: see `success` and\n"
      "`verdict`.");
}

}  // namespace dyntape::python
