// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.Scene and dyntape.simulate.
#include "scenes.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/scene/scene_of_robot.h>
#include <dyntape/interface/files/scene/start_notes.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/player/player.h>

#include "module.h"
#include "robot.h"
#include "watch.h"

namespace dyntape::python {
namespace {

std::string value_text(nb::handle value) {
  if (PyBool_Check(value.ptr())) return value.is(Py_True) ? "on" : "off";
  if (PyUnicode_Check(value.ptr())) return nb::cast<std::string>(value);
  if (value.is_none()) return "";
  if (PyLong_Check(value.ptr())) return nb::cast<std::string>(nb::str(value));
  if (!PySequence_Check(value.ptr())) return io::shortest(nb::cast<double>(nb::float_(value)));
  std::string text;
  for (nb::handle entry : value) text += (text.empty() ? "" : " ") + value_text(entry);
  return text;
}

std::shared_ptr<PythonScene> from_text(const std::string& text, std::shared_ptr<Robot> robot,
                                       const std::filesystem::path& folder, nb::handle set) {
  const std::vector<io::Setting> settings = settings_from(set);
  const std::string path = (folder / "(text)").string();
  if (!robot) return std::make_shared<PythonScene>(read_scene_text(text, path, settings));
  GivenRobot given{robot->urdf, robot->collisions()};
  given.robot.model.gravity = robot->source.gravity;
  return std::make_shared<PythonScene>(read_scene_text(given, text, path, settings));
}

std::shared_ptr<PythonSimulation> simulated(std::shared_ptr<PythonScene> scene, nb::handle progress) {
  SimulatedMotion motion = watched(progress, [&](const Watch& watch) {
    return simulate(scene->scene, {watch.stop, watch.tell});
  });
  return std::shared_ptr<PythonSimulation>(
      new PythonSimulation{scene, SimulationReport{scene->scene, std::move(motion), {}, {}}});
}

std::shared_ptr<PythonSimulation> simulate_file(nb::handle scene, nb::handle set, nb::handle progress) {
  return simulated(given_or_read<PythonScene>(read_scene, scene, set, "simulate"), progress);
}

std::string summary(const PythonScene& s) {
  const dynamics::Model<double>& model = s.model;
  return "<dyntape.Scene \"" + s.scene.name + "\": robot \"" + model.name + "\", nq " +
         std::to_string(model.nq) + ", nv " + std::to_string(model.nv) + ", " +
         io::shortest(s.scene.duration) + " s in steps of " + io::shortest(s.scene.step) + " s, " +
         to_string(s.scene.integrator) + ">";
}

// --- Results ----------------------------------------------------------------------------------------------

nb::dict flows_of(const SimulatedMotion& motion, std::vector<double> EnergyFlow::*which) {
  nb::dict flows;
  for (const EnergyFlow& flow : motion.flows) flows[flow.name.c_str()] = entries_of(flow.*which);
  return flows;
}

// Rows of the independent joints.
Eigen::MatrixXd owned(const std::vector<int>& owners, const Eigen::MatrixXd& all) {
  return owners.empty() ? all : Eigen::MatrixXd(all(owners, Eigen::all));
}

std::string page(const PythonSimulation& s) {
  return player_page(scene_player(s.scene->scene, s.report.motion));
}

void bind_scene(nb::module_& module) {
  using S = PythonScene;
  nb::class_<S> scene(
      module, "Scene",
      "A robot, what acts on it, how it starts, and how its motion is computed: an .info file, read.\n\n"
      "Raises FileError with a line for every problem of the file.\n\n"
      ">>> scene = dyntape.Scene(\"config/scenes/pendulum.info\", set={\"simulation.duration\": 2})\n"
      ">>> scene.simulate().verdict\n"
      "'simulated 2 s'");
  def_read(scene, read_scene);
  def_no_pickle(scene, "pass on its file's path and settings, and read it there");
  scene
      .def_static(
          "from_text", from_text, nb::arg("text"), nb::kw_only(), nb::arg("robot") = nb::none(),
          nb::arg("folder") = ".", nb::arg("set") = nb::none(),
          nb::sig(
              "def from_text(text: str, *, robot: Robot | None = None, folder: str | os.PathLike[str] = '.', "
              "set: Mapping[str, Any] | None = None) -> Scene"),
          "The same from text; other files are looked for in `folder`.\n\n"
          "robot: in the place of the text's key `robot`, wherever it comes from; `shapes collision` of "
          "contacts has it\n"
          "touch where its file or the model that it was made of says.  Not with (cos, sin) joints.\n\n"
          ">>> robot = dyntape.load(\"config/robots/pendulum.urdf\")\n"
          ">>> dyntape.Scene.from_text(\"simulation { duration 2 }\", robot=robot).simulate().verdict\n"
          "'simulated 2 s'")
      .def_prop_ro(
          "name", [](const S& s) { return s.scene.name; }, "Its name.")
      .def_prop_ro(
          "nq", [](const S& s) { return s.model.nq; },
          "Entries of q; joints that follow others (`robot { mimic true }`) have none.")
      .def_prop_ro(
          "nv", [](const S& s) { return s.model.nv; }, "Entries of v, likewise.")
      .def_prop_ro(
          "q", [](const S& s) { return entries_of(Eigen::VectorXd(s.ties.own_q(s.scene.q))); },
          nb::sig("def q(self) -> Array"), "(nq,) at the start.")
      .def_prop_ro(
          "v", [](const S& s) { return entries_of(Eigen::VectorXd(s.ties.own_v(s.scene.v))); },
          nb::sig("def v(self) -> Array"), "(nv,) at the start.")
      .def_prop_ro(
          "driven", [](const S& s) { return driven_names(s.scene.robot); },
          "Joints that are driven, in the order of the commands u.")
      .def_prop_ro(
          "duration", [](const S& s) { return s.scene.duration; }, "s.")
      .def_prop_ro(
          "step", [](const S& s) { return s.scene.step; }, "s, of the integrator.")
      .def_prop_ro(
          "integrator", [](const S& s) { return to_string(s.scene.integrator); }, "What one step is.")
      .def_prop_ro(
          "notes", [](const S& s) { return notes_of(s.scene); },
          "What is odd in the robot's file, a sentence each.")
      .def_prop_ro(
          "effective", [](const S& s) { return s.scene.effective; },
          "The file as it was understood, defaults included.")
      .def(
          "explain",
          [](const S& s) {
            return watched(nb::none(), [&](const Watch& watch) { return explain(s.scene, watch.stop); });
          },
          "What is recorded: the effects that act and what each costs, and how accurate the motion would be.")
      .def("simulate", simulated, nb::kw_only(), nb::arg("progress") = nb::none(),
           nb::sig("def simulate(self, *, progress: Progress = None) -> Simulation"),
           "Simulates from the start.  progress: is called with a sentence about the progress.  Ctrl-C stops "
           "it.")
      .def("__repr__", summary);
  bind_rollouts(scene);
}

void bind_simulation(nb::module_& module) {
  using S = PythonSimulation;
  nb::class_<S> type(module, "Simulation", "A simulated motion; samples come first in every array.");
  const auto values = [&](const char* name, std::vector<double> SimulatedMotion::*which, const char* what) {
    def_array(type, name, what, [which](const S& s) { return entries_of(s.report.motion.*which); });
  };
  const auto vectors = [&](const char* name, Eigen::MatrixXd SimulatedMotion::*which, const char* what) {
    def_array(type, name, what, [which](const S& s) { return rows_of(s.report.motion.*which); });
  };
  values("t", &SimulatedMotion::t, "(samples,) s.");
  def_array(type, "q", "(samples, nq).",
            [](const S& s) { return rows_of(owned(s.scene->ties.q_owners, s.report.motion.q)); });
  def_array(type, "v", "(samples, nv).",
            [](const S& s) { return rows_of(owned(s.scene->ties.v_owners, s.report.motion.v)); });
  vectors("drive", &SimulatedMotion::drive, "(samples, driven joints) torques of the motors, N m or N.");
  values("kinetic", &SimulatedMotion::kinetic, "(samples,) J.");
  values("stored", &SimulatedMotion::stored, "(samples,) J: what gravity and springs hold.");
  def_report(type, "Whether the motion came to its end and its steps can be trusted.");
  def_page(type, page);
  def_files(
      type, [](S& s, const std::string& folder) { write_results(s.report, folder); },
      "motion.csv, report.json");
  type.def_prop_ro(
          "power", [](const S& s) { return flows_of(s.report.motion, &EnergyFlow::power); },
          nb::sig("def power(self) -> dict[str, Array]"),
          "(samples,) W of the motors and of each effect; positive: the robot gains energy.")
      .def_prop_ro(
          "work", [](const S& s) { return flows_of(s.report.motion, &EnergyFlow::work); },
          nb::sig("def work(self) -> dict[str, Array]"), "(samples,) J since the start, likewise.")
      .def_prop_ro(
          "energy_error", [](const S& s) { return s.report.motion.energy_error(); },
          "J: what the energy balance is off by.")
      .def_prop_ro(
          "verdict", [](const S& s) { return s.report.verdict(); }, "One sentence.")
      .def_prop_ro(
          "trouble", [](const S& s) { return s.report.motion.trouble; },
          "Why it ended ahead of its time, or nothing.")
      .def_prop_ro(
          "warning", [](const S& s) { return s.report.motion.warning; },
          "Where its steps are too long, or nothing.")
      .def("__repr__", [](const S& s) {
        return "<dyntape.Simulation of \"" + s.scene->scene.name +
               "\": " + std::to_string(s.report.motion.samples()) + " samples; " + s.report.verdict() + ">";
      });
}

}  // namespace

std::vector<io::Setting> settings_from(nb::handle given) {
  std::vector<io::Setting> settings;
  if (!given.is_valid() || given.is_none()) return settings;
  if (!nb::isinstance<nb::dict>(given))
    throw nb::type_error(("set: expected a dictionary, {\"simulation.duration\": 2}, got " +
                          nb::cast<std::string>(nb::repr(given.type())))
                             .c_str());
  for (const auto& [key, value] : nb::borrow<nb::dict>(given))
    settings.push_back({text_of(key, "set"), value_text(value)});
  return settings;
}

void bind_scenes(nb::module_& module) {
  bind_simulation(module);
  bind_scene(module);
  module.def(
      "simulate", simulate_file, nb::arg("scene"), nb::kw_only(), nb::arg("set") = nb::none(),
      nb::arg("progress") = nb::none(),
      nb::sig("def simulate(scene: str | os.PathLike[str] | Scene, *, set: Mapping[str, Any] | None = None, "
              "progress: Progress = None) -> Simulation"),
      "The motion of a scene file or Scene.\n"
      "\n"
      "set: values for keys of the file, by key path: {\"simulation.duration\": 2, \"effects.gravity\": "
      "\"off\"}.\n"
      "progress: a function that gets sentences about the progress, e.g. `print`; True shows a line.  Ctrl-C "
      "stops it.\n"
      "\n"
      "Raises FileError for mistakes in the file.  A motion that ends ahead of its time is no error: see "
      "`success`,\n"
      "`verdict`, `trouble`.");
}

}  // namespace dyntape::python
