// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.load and what a robot says of itself.
#include "robot.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <filesystem>
#include <tuple>
#include <variant>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/urdf/check.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "bridges/bodies.h"
#include "robots/limits.h"
#include "watch.h"

namespace dyntape::python {
namespace {

dynamics::UrdfRobot read(const RobotSourceText& source) {
  if (source.bodies) return {source.bodies->model, {}, {}, source.bodies->left_out};
  dynamics::UrdfRobot robot = dynamics::read_urdf_text(source.text, source.file, source.options);
  robot.model.gravity = source.gravity;
  for (std::string& note : robot.notes)
    if (note.ends_with(dynamics::kReadAsIndependent)) note += "; load it with mimic=True to have it follow";
  return robot;
}

// Warns, from the caller's line, of joints that move on their own though their file ties them.
void warn_of_independent(const Robot& robot) {
  for (const std::string& note : robot.urdf.notes) {
    if (note.find(dynamics::kReadAsIndependent) == note.npos) continue;
    for (const auto& joint : robot.model().joints) {
      if (note.find("joint \"" + joint.name + "\" mimics") == note.npos) continue;
      if (PyErr_WarnEx(PyExc_UserWarning, note.c_str(), 1) < 0) nb::raise_python_error();
    }
  }
}

// What a function without a frame says of the sizes of states.
dyntape::detail::RobotSizes sizes_of(const dynamics::UrdfRobot& robot) {
  RobotFunction function = RobotFunction::kRnea;
  function.mimics = robot.mimics;
  return dyntape::detail::sizes_of(robot.model, function);
}

template <class Value>
Value choice(const std::string& what, const std::string& word,
             const std::vector<std::pair<std::string, Value>>& choices) {
  std::string all;
  for (const auto& [name, value] : choices) {
    if (word == name) return value;
    all += (all.empty() ? "\"" : ", \"") + name + "\"";
  }
  throw ArgumentError(what + ": expected one of " + all + ", got \"" + word + "\"");
}

dynamics::Base base_from(const std::string& word) {
  return choice<dynamics::Base>("base", word,
                                {{"fixed", dynamics::Base::kFixed}, {"floating", dynamics::Base::kFloating}});
}

dynamics::ContinuousJoint continuous_from(const std::string& word) {
  using enum dynamics::ContinuousJoint;
  return choice<dynamics::ContinuousJoint>("continuous", word, {{"cos-sin", kCosSin}, {"angle", kAngle}});
}

Eigen::Vector3d gravity_from(const std::vector<double>& gravity) {
  if (gravity.size() != 3)
    throw ArgumentError("gravity: expected 3 numbers, m/s^2 in the world's axes, got " +
                        std::to_string(gravity.size()));
  return Eigen::Map<const Eigen::Vector3d>(gravity.data());
}

// A name, or names: lock="wrist" beside lock=["wrist", "finger"].
using NameOrNames = std::variant<std::string, std::vector<std::string>>;

std::vector<std::string> all(const NameOrNames& names) {
  if (const auto* one = std::get_if<std::string>(&names)) return {*one};
  return std::get<std::vector<std::string>>(names);
}

// Options of reading, as keywords.
struct LoadOptions {
  std::string base;
  std::vector<std::string> lock;
  bool mimic;
  std::vector<double> gravity;
  std::string continuous, root;
  double snap;
  bool accept_nonphysical_inertia;
};

std::shared_ptr<Robot> robot_of(const std::string& text, const std::string& file, const LoadOptions& o) {
  RobotSourceText source;
  source.text = text;
  source.file = file;
  source.gravity = gravity_from(o.gravity);
  source.options = {base_from(o.base),
                    o.lock,
                    o.snap,
                    continuous_from(o.continuous),
                    o.root,
                    o.accept_nonphysical_inertia,
                    o.mimic};
  std::shared_ptr<Robot> robot;
  {
    const nb::gil_scoped_release unlocked;
    robot = std::make_shared<Robot>(std::move(source));
  }
  warn_of_independent(*robot);
  return robot;
}

// The text of a robot's file.  FileError: it cannot be read; names a shipped robot of this name.
std::string text_of_robot(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) {
    const auto shipped = std::filesystem::path(nb::cast<std::string>(
                             nb::str(nb::module_::import_("dyntape").attr("config_folder")()))) /
                         "robots" / file.filename();
    if (std::filesystem::exists(shipped))
      throw FileError(file.string() + ": there is no such file; the robot that dyntape brings along is " +
                      "dyntape.config_folder() / \"robots/" + file.filename().string() + "\"");
  }
  return read_file(file.string());
}

// The function with its keywords; `first` are those before them.
template <class F, class... First>
void define_load(nb::module_& module, const char* name, F f, const char* what, const First&... first) {
  module.def(name, f, first..., nb::kw_only(), nb::arg("base") = "fixed",
             nb::arg("lock") = NameOrNames(std::vector<std::string>()), nb::arg("mimic") = false,
             nb::arg("gravity") = std::vector<double>{0, 0, -9.81}, nb::arg("continuous") = "cos-sin",
             nb::arg("root") = "", nb::arg("snap") = 1e-8, nb::arg("accept_nonphysical_inertia") = false,
             what);
}

// --- Pickling: a robot is the text that it was read from, or its bodies -----------------------------------

using TextState = std::tuple<std::string, std::string, int, std::vector<std::string>, double, int,
                             std::string, bool, bool, std::vector<double>>;

TextState state_of_text(const RobotSourceText& s) {
  const dynamics::UrdfOptions& o = s.options;
  return {s.text,
          s.file,
          static_cast<int>(o.base),
          o.lock,
          o.snap,
          static_cast<int>(o.continuous),
          o.root,
          o.accept_nonphysical_inertia,
          o.mimic,
          std::vector<double>(s.gravity.begin(), s.gravity.end())};
}

nb::object robot_state(const Robot& robot) {
  return robot.source.bodies ? nb::cast(state_of(*robot.source.bodies))
                             : nb::cast(state_of_text(robot.source));
}

void restore(Robot& robot, const TextState& state) {
  const auto& [text, file, base, lock, snap, continuous, root, accept, mimic, gravity] = state;
  RobotSourceText source;
  source.text = text;
  source.file = file;
  source.options = {static_cast<dynamics::Base>(base),
                    lock,
                    snap,
                    static_cast<dynamics::ContinuousJoint>(continuous),
                    root,
                    accept,
                    mimic};
  source.gravity = gravity_from(gravity);
  new (&robot) Robot(std::move(source));
}

// --- What it says of itself -------------------------------------------------------------------------------

std::string summary(const Robot& robot) {
  const dynamics::Model<double>& model = robot.model();
  const bool floats = !model.joints.empty() && model.joints.front().type == dynamics::JointType::kFreeFlyer;
  return "<dyntape.Robot \"" + model.name + "\": " + std::to_string(model.njoints()) + " joints, nq " +
         std::to_string(robot.nq) + ", nv " + std::to_string(robot.nv) + ", " +
         std::to_string(model.frames.size()) + " frames, " + (floats ? "floating" : "fixed") + " base>";
}

// Joints of the robot's model that have entries of their own, in the order of these.
std::vector<const dynamics::Joint<double>*> own_joints(const Robot& robot,
                                                       const dynamics::Model<double>& model) {
  std::vector<const dynamics::Joint<double>*> joints;
  for (const auto& joint : model.joints) {
    const auto follows = [&](const dynamics::MimicRule& rule) { return rule.joint == joint.name; };
    if (std::none_of(robot.urdf.mimics.begin(), robot.urdf.mimics.end(), follows)) joints.push_back(&joint);
  }
  return joints;
}

// (nv) one of a joint's limits; infinite where there is none.
nb::object limits(const Robot& robot, double dynamics::JointLimits::*which, double none) {
  std::vector<double> all;
  const dynamics::Model<double> model = with_tied_limits(robot);
  for (const auto* joint : own_joints(robot, model)) {
    const bool has_limits = dynamics::is_single(joint->type);
    const double limit = has_limits ? joint->limits.*which : none;
    all.insert(all.end(), static_cast<std::size_t>(dynamics::nv(joint->type)), limit);
  }
  return copy_of(all.data(), {robot.nv});
}

void bind_facts(nb::class_<Robot>& robot) {
  constexpr double kNone = dynamics::JointLimits::kNone;
  using Limits = dynamics::JointLimits;
  robot
      .def_prop_ro(
          "name", [](const Robot& r) { return r.model().name; }, "Name of the robot, as its file gives it.")
      .def_ro("nq", &Robot::nq, "Entries of a configuration q.")
      .def_ro("nv", &Robot::nv, "Entries of v, a and tau: degrees of freedom.")
      .def_prop_ro(
          "joints",
          [](const Robot& r) {
            std::vector<std::string> names;
            for (const auto* joint : own_joints(r, r.model())) names.push_back(joint->name);
            return names;
          },
          "Names of the joints that have entries in q and v, in their order.")
      .def_prop_ro(
          "joint_types",
          [](const Robot& r) {
            std::vector<std::string> types;
            for (const auto* joint : own_joints(r, r.model()))
              types.push_back(dynamics::to_string(joint->type));
            return types;
          },
          "Type of each of these: revolute, continuous, prismatic, helical, spherical, planar or free-flyer.")
      .def_prop_ro(
          "frames", [](const Robot& r) { return dynamics::detail::names_of(r.model().frames); },
          "Names of the frames: every link of the file.")
      .def_prop_ro(
          "gravity_vector", [](const Robot& r) { return copy_of(r.source.gravity.data(), {3}); },
          "(3,) acceleration of free fall, m/s^2, in the world's axes.")
      .def_prop_ro(
          "lower_limits", [](const Robot& r) { return limits(r, &Limits::lower, -kNone); },
          "(nv,) lowest positions, rad or m, of a joint and of those that follow it; -inf where there is no "
          "limit.")
      .def_prop_ro(
          "upper_limits", [](const Robot& r) { return limits(r, &Limits::upper, kNone); },
          "(nv,) highest positions, rad or m, of a joint and of those that follow it; inf where there is no "
          "limit.")
      .def_prop_ro(
          "velocity_limits", [](const Robot& r) { return limits(r, &Limits::velocity, kNone); },
          "(nv,) largest speeds, rad/s or m/s, of a joint and of those that follow it; inf where there is no "
          "limit.")
      .def_prop_ro(
          "effort_limits", [](const Robot& r) { return limits(r, &Limits::effort, kNone); },
          "(nv,) largest torques, N m or N; inf where there is no limit.")
      .def_prop_ro(
          "left_out", [](const Robot& r) { return r.urdf.left_out; },
          "What of its file, or of the model that it was made of, has no counterpart here, a sentence each.")
      .def_prop_ro(
          "notes", [](const Robot& r) { return r.urdf.notes; },
          "What is odd or was corrected in the robot's file, a sentence each.")
      .def("__repr__", summary)
      .def(
          "_repr_html_",
          [](nb::handle self) { return nb::module_::import_("dyntape._pictures").attr("robot_page")(self); },
          "A table of the joints with their limits.")
      .def("__getstate__", robot_state)
      .def("__setstate__", restore)
      .def(
          "__copy__", [](std::shared_ptr<Robot> self) { return self; },
          "A robot never changes: the same one.")
      .def(
          "__deepcopy__", [](std::shared_ptr<Robot> self, nb::handle) { return self; }, nb::arg("memo"),
          "A robot never changes: the same one.");
}

}  // namespace

Robot::Robot(RobotSourceText from)
    : source(std::move(from)), urdf(read(source)), nq(sizes_of(urdf).nq), nv(sizes_of(urdf).nv) {
  for (auto& defaults : defaults_) defaults.resize(robot_functions().size());
}

dynamics::UrdfVisuals Robot::visuals(const dynamics::VisualOptions& what) const {
  if (!source.bodies) return dynamics::read_visuals_text(source.text, source.file, model(), what);
  if (what.of == dynamics::VisualOptions::Of::kCollisions) return {};
  return {source.bodies->shapes, {}, {}};
}

dynamics::UrdfCollisions Robot::collisions() const {
  if (source.bodies) return {source.bodies->touching, {}, {}};
  return dynamics::read_collisions_text(source.text, source.file, model());
}

RobotFunction Robot::function(const RobotCall& call) const {
  RobotFunction function = robot_functions()[static_cast<std::size_t>(call.row)];
  using enum dynamics::ReferenceFrame;
  function.frame = call.frame;
  function.in = choice<dynamics::ReferenceFrame>(
      std::string(to_string(function)) + ": axes", call.axes,
      {{"local", kLocal}, {"world", kWorld}, {"aligned", kLocalWorldAligned}});
  function.contacts = call.contacts;
  function.mimics = urdf.mimics;
  return function;
}

std::shared_ptr<RobotPath> Robot::route(const RobotCall& call) const {
  {
    const std::scoped_lock lock(mutex_);
    const auto found = routes_.find(call);
    if (found != routes_.end()) return found->second;
  }
  // Two threads may make the same; the first that is done serves.
  const RobotFunction function = this->function(call);
  std::shared_ptr<RobotPath> made = left_alone(nb::find(*this), [=, this](const std::stop_token& stop) {
    return make_route(model(), function, call.route, call.device, call.many, stop);
  });
  const std::scoped_lock lock(mutex_);
  return routes_.emplace(call, std::move(made)).first->second;
}

RobotPath& Robot::default_route(int row, bool many) const {
  std::shared_ptr<RobotPath>& route = defaults_[many][static_cast<std::size_t>(row)];
  if (!route) route = this->route({.row = row, .many = many, .route = default_word(many)});
  return *route;
}

std::shared_ptr<const Callee> Robot::callee(const RobotFunction& function) const {
  const bool is_inverse = function.row() == RobotFunction::kRnea.row();
  if (!is_inverse && function.row() != RobotFunction::kAba.row()) return nullptr;
  if (!function.mimics.empty() || !is_worth_callees(model())) return nullptr;
  const std::scoped_lock lock(mutex_);
  std::shared_ptr<const Callee>& callee = callees_[function.row()];
  if (!callee) callee = is_inverse ? inverse_dynamics_callee(model()) : forward_dynamics_callee(model());
  return callee;
}

void bind_robot(nb::module_& module) {
  nb::class_<Robot> robot(
      module, "Robot",
      "A robot: made by `dyntape.load` or `dyntape.assemble`, never changed, to be used by any number of "
      "threads.\n\n"
      "Every function of dyntape's table is a method.  The leading axes of arguments are batch axes, which "
      "broadcast\n"
      "as numpy's do: q of shape (1000, nq) gives results of shape (1000, ...).  Derivatives by q are "
      "tangent, a\n"
      "column for each velocity.  Units: kg, m, rad, s, N, N m.");
  bind_facts(robot);
  bind_configurations(robot);
  bind_casadi(robot);
  bind_bodies(module, robot);
  bind_shapes(robot);
  bind_robot_methods(module, robot);
  bind_nonzeros(module, robot);
  using Vector = std::vector<double>;
  define_load(
      module, "load",
      [](const std::filesystem::path& file, const std::string& base, const NameOrNames& lock, bool mimic,
         const Vector& gravity, const std::string& continuous, const std::string& root, double snap,
         bool accept) {
        return robot_of(text_of_robot(file), file.string(),
                        {base, all(lock), mimic, gravity, continuous, root, snap, accept});
      },
      "Reads a robot from a URDF file.\n\n"
      "base: \"fixed\", the root link is the world, or \"floating\", a free-flyer carries it.\n"
      "lock: a name, or names, of joints that are held at their neutral position.\n"
      "mimic: joints with <mimic> follow their leader and have no entries in q, v and tau of their own; "
      "otherwise they\n   move on their own, with a warning.\n"
      "gravity: acceleration of free fall, m/s^2, in the world's axes.\n"
      "continuous: \"cos-sin\", a continuous joint has two entries in q, or \"angle\", it has one.\n"
      "root: the link that is fixed to the world or floats; empty for the root of the file.\n"
      "snap: rotations within this angle, rad, of a right one become exact; 0 reads them literally.\n"
      "accept_nonphysical_inertia: an inertia that no body has is a note, not an error.\n\n"
      "Raises FileError, `file:line: sentence`, for what is wrong in the file, and ArgumentError for an "
      "option that\n"
      "does not fit it.\n\n"
      ">>> robot = dyntape.load(\"config/robots/panda.urdf\", lock=[\"panda_finger_joint1\", "
      "\"panda_finger_joint2\"])\n"
      ">>> robot.nq\n7",
      nb::arg("file"));
  define_load(
      module, "load_text",
      [](const std::string& text, const std::string& name, const std::string& base, const NameOrNames& lock,
         bool mimic, const Vector& gravity, const std::string& continuous, const std::string& root,
         double snap, bool accept) {
        return robot_of(text, name, {base, all(lock), mimic, gravity, continuous, root, snap, accept});
      },
      "Loads a robot from the text of a URDF file.  `name` is the file's name in messages; meshes are "
      "searched relative to it.",
      nb::arg("text"), nb::arg("name") = "robot.urdf");
}

}  // namespace dyntape::python
