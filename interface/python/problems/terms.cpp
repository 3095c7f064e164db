// SPDX-License-Identifier: BSD-3-Clause
//
// Terms of a problem: Python functions and ready ones, in every role and place.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/capsules.h>
#include <dyntape/interface/motion/contact_changes.h>
#include <dyntape/interface/motion/inverse_kinematics.h>
#include <dyntape/interface/motion/robot_terms.h>

#include "../problems.h"

namespace dyntape::python {
namespace {

using P = PythonProblem;

// Two terms of one name cannot be told apart in verdicts.
void add_term(P& p, Term term) {
  for (const Term& other : p.problem.terms)
    if (other.name == term.name)
      throw ArgumentError("problem \"" + p.problem.name + "\": two terms are called \"" + term.name +
                          "\"; expected another name");
  p.problem.add(std::move(term));
}

double weight_of(const std::string& call, double weight) {
  if (weight >= 0 && std::isfinite(weight)) return weight;
  throw ArgumentError(call + ": weight is " + io::shortest(weight) + "; expected zero or more");
}

// "running", "end", "start", or a share of the duration.
Term placed(Term term, nb::handle where) {
  if (PyUnicode_Check(where.ptr())) {
    const std::string word = nb::cast<std::string>(where);
    if (word == "running") return term;
    if (word == "start") return at_start(std::move(term));
    if (word == "end") {
      term.where = Where::kTerminal;
      return term;
    }
    throw ArgumentError(
        term.name + ": where: expected \"running\", \"start\", \"end\" or a share of the duration, got \"" +
        word + "\"");
  }
  return at_fraction(nb::cast<double>(where), std::move(term));
}

void add_cost(P& p, const std::string& name, nb::handle f, nb::handle where) {
  add_term(p, placed(running_cost(name, stage_function_of(p, name, f)), where));
}

void add_squares(P& p, const std::string& name, nb::handle f, double weight, nb::handle where) {
  (void)weight_of("add_squares(\"" + name + "\")", weight);
  const StageFunction residuals = stage_function_of(p, name, f);
  add_term(p, placed(running_squares(name, weight == 1 ? residuals : weighted(residuals, weight)), where));
}

void add_equality(P& p, const std::string& name, nb::handle f, nb::handle where) {
  Term term = placed(path_equality(name, stage_function_of(p, name, f)), where);
  std::optional<double> share;
  if (term.where != Where::kRunning) share = term.where == Where::kTerminal ? 1 : term.share;
  add_term(p, std::move(term));
  if (!nb::isinstance<PythonStageFunction>(f)) return;
  const auto& target = nb::cast<const PythonStageFunction&>(f).target;
  if (target) p.demands.push_back({*target, share, false, floor_under(p.scene, target->position)});
}

// A number for all entries, an array, or none.
Eigen::VectorXd bound(nb::handle given, const std::string& what, Eigen::Index n, double otherwise) {
  if (given.is_none()) return Eigen::VectorXd::Constant(n, otherwise);
  const Numbers values = numbers(given, what);
  if (values.shape.empty()) return Eigen::VectorXd::Constant(n, *values.data);
  return vector_of(given, what, n);
}

void add_inequality(P& p, const std::string& name, nb::handle f, nb::handle lower, nb::handle upper,
                    nb::handle where) {
  if (lower.is_none() && upper.is_none())
    throw ArgumentError("add_inequality(\"" + name + "\"): expected a lower or an upper bound, got neither");
  const StageFunction values = stage_function_of(p, name, f);
  const Problem& problem = p.problem;
  const Eigen::Index n =
      values(problem.stage(0, Eigen::VectorXd::Constant(problem.n_x(), 0.5),
                           Eigen::VectorXd::Zero(problem.n_a()), Eigen::VectorXd::Zero(problem.n_u())))
          .size();
  const double none = std::numeric_limits<double>::infinity();
  const Eigen::VectorXd least = bound(lower, name + ": lower", n, -none);
  const Eigen::VectorXd most = bound(upper, name + ": upper", n, none);
  check_bounds("add_inequality(\"" + name + "\")", {}, least, most);
  add_term(p, placed(path_inequality(name, values, least, most), where));
}

const RobotScene& scene_of(const P& p, const char* what) {
  if (!p.is_robot) throw ArgumentError(std::string(what) + ": only for a robot's problem (robot.problem)");
  return p.scene;
}

ControlUnit unit_of(const P& p) { return p.options.unit; }

// --- Ready functions --------------------------------------------------------------------------------------

Eigen::Matrix3d rotation(nb::handle given, const char* what) {
  const Numbers r = numbers(given, what);
  if (r.shape == Shape{3}) return rotation_of(r.data[0], r.data[1], r.data[2]);
  if (r.shape == Shape{3, 3}) return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data);
  throw ArgumentError(std::string(what) +
                      ": expected (3,) roll, pitch, yaw in rad, or a rotation (3, 3), got " +
                      shape_text(r.shape));
}

FrameTarget target_of(const std::string& frame, nb::handle position, nb::handle orientation) {
  FrameTarget target{frame, {}, {}};
  if (!position.is_none()) target.position = vector_of(position, "position", 3);
  if (!orientation.is_none()) target.orientation = rotation(orientation, "orientation");
  return target;
}

PythonStageFunction frame_error_of(const P& p, const std::string& frame, nb::handle position,
                                   nb::handle orientation) {
  const FrameTarget target = target_of(frame, position, orientation);
  PythonStageFunction error{"frame_error of " + frame,
                            p.of_all(frame_error(scene_of(p, "frame_error"), target))};
  if (target.position) error.target = {frame, *target.position};
  return error;
}

std::optional<nb::object> inverse_kinematics_of(const P& p, const std::string& frame, nb::handle position,
                                                nb::handle orientation, nb::handle q) {
  const RobotScene& scene = scene_of(p, "inverse_kinematics");
  const FrameTarget target = target_of(frame, position, orientation);
  Eigen::VectorXd from = p.problem.start.head(p.nq());
  if (!q.is_none()) from = vector_of(q, "q", p.nq());
  InverseKinematicsOptions options;
  const StageFunction error = frame_error(scene, target);
  const auto left = [&](const Eigen::VectorXd& all) {  // with followers where their leaders put them
    Stage<double> s{0, Eigen::VectorXd::Zero(scene.model.nq + scene.model.nv), {}, {}};
    s.x.head(scene.model.nq) = p.tied->all_q(p.tied->own_q(all));
    return error(s).lpNorm<Eigen::Infinity>();
  };
  constexpr double kThere = 1e-6;
  if (p.tied) options.accept = [&](const Eigen::VectorXd& all) { return left(all) < kThere; };
  const auto found = inverse_kinematics(scene, target, p.all_q(from), options);
  if (!found) return {};
  const Eigen::VectorXd own = p.tied ? p.tied->own_q(*found) : *found;
  return copy_of(own.data(), {own.size()});
}

// ("sphere name", frame, center, radius) or ("name", frame, from, to, radius).
Capsule capsule_of(nb::handle given, bool moves) {
  const nb::tuple t(nb::borrow(given));
  const std::size_t first = moves ? 2 : 1, n = t.size() - std::min(t.size(), first);
  if (n != 2 && n != 3)
    throw ArgumentError(std::string("keep_clear: expected (name, ") + (moves ? "frame, " : "") +
                        "center, radius) or (name, " + (moves ? "frame, " : "") + "from, to, radius), got " +
                        std::to_string(t.size()) + " entries");
  const std::string name = text_of(t[0], "keep_clear: name"),
                    frame = moves ? text_of(t[1], "keep_clear: frame") : kWorld;
  const Eigen::Vector3d from = vector_of(t[first], name, 3), to = vector_of(t[first + n - 2], name, 3);
  return capsule(name, frame, from, to, nb::cast<double>(t[first + n - 1]));
}

void keep_clear_of(P& p, nb::handle body, nb::handle obstacle, double least) {
  Term term =
      keep_clear(scene_of(p, "keep_clear"), capsule_of(body, true), capsule_of(obstacle, false), least);
  term.function = p.of_all(term.function);
  add_term(p, std::move(term));
}

void swing_clearance_of(P& p, const std::string& frame, nb::handle start, nb::handle end, double clearance,
                        std::optional<double> floor) {
  HeldContact foot{.frame = frame};
  foot.place = vector_of(start, "swing_clearance: start", 3);
  const Eigen::Vector3d foothold = vector_of(end, "swing_clearance: end", 3);
  Term term = swing_clearance(scene_of(p, "swing_clearance"), foot, foothold, clearance);
  term.function = p.of_all(term.function);
  add_term(p, std::move(term));
  if (!floor) floor = floor_under(p.scene, foothold);
  const bool steps_down = foothold.z() < foot.place->z() && floats(p.scene.model);
  if (!floor && steps_down) floor = 0;
  p.demands.push_back({{frame, foothold}, 1.0, true, floor, clearance, *foot.place});
}

// Bounds of the states from the robot's limits.
void set_bounds(P& p, const char* what, void (*set)(Problem&, const RobotScene&)) {
  const RobotScene& scene = scene_of(p, what);
  if (!p.tied) return set(p.problem, scene);
  p.tied->set_bounds(p.problem, [&](Problem& all) { set(all, scene); });
}

}  // namespace

Eigen::VectorXd vector_of(nb::handle given, const std::string& what, Eigen::Index entries) {
  const Numbers values = numbers(given, what, {entries});
  return Eigen::VectorXd::Map(values.data, entries);
}

void bind_terms(nb::class_<P>& problem) {
  const auto running = [] { return nb::arg("where") = "running"; };
#define DYNTAPE_WHERE "where: str | float = 'running') -> None"
  problem.def(
      "add_cost", add_cost, nb::arg("name"), nb::arg("f"), nb::kw_only(), running(),
      nb::sig("def add_cost(self, name: str, f: Callable[[Stage], Any] | StageFunction, *, " DYNTAPE_WHERE),
      "Adds a scalar to what is minimised, integrated over time where it is running.\n\n"
      "f: takes a Stage (t, x, a, u, p; q, v of a robot), returns a value; it is run once, on recorded "
      "values, and\n"
      "   its derivatives of both orders are exact.  Decisions by `dyntape.where`.\n"
      "where: \"running\", \"start\", \"end\", or a share of the duration from 0 to 1.");
  problem.def(
      "add_squares", add_squares, nb::arg("name"), nb::arg("f"), nb::kw_only(), nb::arg("weight") = 1.0,
      running(),
      nb::sig("def add_squares(self, name: str, f: Callable[[Stage], Any] | StageFunction, *, weight: float "
              "= 1, " DYNTAPE_WHERE),
      "The same of residuals, `weight` times whose sum of squares is minimised; Gauss-Newton knows them.");
  problem.def(
      "add_equality", add_equality, nb::arg("name"), nb::arg("f"), nb::kw_only(), running(),
      nb::sig(
          "def add_equality(self, name: str, f: Callable[[Stage], Any] | StageFunction, *, " DYNTAPE_WHERE),
      "Demands that all entries of f be zero.");
  problem.def("add_inequality", add_inequality, nb::arg("name"), nb::arg("f"), nb::arg("lower") = nb::none(),
              nb::arg("upper") = nb::none(), nb::kw_only(), running(),
              nb::sig("def add_inequality(self, name: str, f: Callable[[Stage], Any] | StageFunction, "
                      "lower: ArrayLike | None = None, upper: ArrayLike | None = None, *, " DYNTAPE_WHERE),
              "Demands lower <= f <= upper; a number is for all entries.");
#undef DYNTAPE_WHERE
  problem.def(
      "add_effort",
      [](P& p, double weight) { add_term(p, squared_controls(weight_of("add_effort", weight))); },
      nb::arg("weight") = 1.0, "weight |u|^2, integrated.");
  problem.def(
      "add_accelerations",
      [](P& p, double weight) {
        add_term(p, squared_accelerations(p.problem, weight_of("add_accelerations", weight)));
      },
      nb::arg("weight") = 1.0, "weight |dv/dt|^2, integrated.");
  problem.def(
      "add_minimum_time",
      [](P& p, double weight) { add_term(p, minimum_time(weight_of("add_minimum_time", weight))); },
      nb::arg("weight") = 1.0, "weight times the duration, which is free.");
  problem.def(
      "limit_positions", [](P& p) { set_bounds(p, "limit_positions", limit_positions); },
      "The robot's position limits.");
  problem.def(
      "limit_velocities", [](P& p) { set_bounds(p, "limit_velocities", limit_velocities); },
      "The robot's velocity limits.");
  problem.def(
      "limit_efforts", [](P& p) { limit_efforts(p.problem, scene_of(p, "limit_efforts"), unit_of(p)); },
      "The robot's effort limits.");
  problem.def("frame_error", frame_error_of, nb::arg("frame"), nb::arg("position") = nb::none(),
              nb::arg("orientation") = nb::none(),
              nb::sig("def frame_error(self, frame: str, position: ArrayLike | None = None, "
                      "orientation: ArrayLike | None = None) -> StageFunction"),
              "How far a frame is from where it shall be: position (3,), m; orientation (3,) roll, pitch, "
              "yaw, rad, or a\n"
              "rotation (3, 3); one or both.\n\n"
              "As an equality it is checked before a solve: a position that no configuration within limits "
              "reaches is a warning, in\n"
              "metres.\n\n"
              ">>> p = dyntape.load(\"config/robots/arm_2r.urdf\").problem(1)\n"
              ">>> p.add_equality(\"there\", p.frame_error(\"hand\", [0.3, 0.0, 0.5]), where=\"end\")");
  problem.def("inverse_kinematics", inverse_kinematics_of, nb::arg("frame"), nb::arg("position") = nb::none(),
              nb::arg("orientation") = nb::none(), nb::arg("q") = nb::none(),
              nb::sig("def inverse_kinematics(self, frame: str, position: ArrayLike | None = None, "
                      "orientation: ArrayLike | None = None, q: ArrayLike | None = None) -> Array | None"),
              "(nq,) a configuration within limits in which the frame is there, looked for from q, by "
              "default the start;\n"
              "None where none was found.");
  problem.def(
      "keep_clear", keep_clear_of, nb::arg("body"), nb::arg("obstacle"), nb::kw_only(),
      nb::arg("least") = 0.0,
      nb::sig(
          "def keep_clear(self, body: Sequence[Any], obstacle: Sequence[Any], *, least: float = 0) -> None"),
      "Keeps a body of the robot clear of an obstacle by `least`, m, all along.\n\n"
      "body: (name, frame, center, radius) or (name, frame, from, to, radius), in the frame's axes;\n"
      "obstacle: the same without a frame, in the world.");
  problem.def(
      "swing_clearance", swing_clearance_of, nb::arg("frame"), nb::arg("start"), nb::arg("end"),
      nb::arg("clearance"), nb::kw_only(), nb::arg("floor") = nb::none(),
      nb::sig("def swing_clearance(self, frame: str, start: ArrayLike, end: ArrayLike, clearance: float, *, "
              "floor: float | None = None) -> None"),
      "Keeps a frame's origin above the straight line from start to end, both (3,), m, in the world.\n\n"
      "At the share s of the way over the ground the height is 4 s (1 - s) clearance, m: zero at both ends, "
      "largest in the\n"
      "middle.  Where start and end are one above the other, the origin is that high at half of the "
      "duration.\n\n"
      "floor: its height, m; by default that of the scene, or 0 where a floating robot steps down.  A solve "
      "warns, in metres, of\n"
      "an end below the floor and of one\n"
      "that no configuration within the limits of the joints reaches.");
}

}  // namespace dyntape::python
