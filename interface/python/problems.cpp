// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape.Problem: optimal control of a robot (robot.problem) or of a dynamics of one's own.
#include "problems.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/motion/robot_configuration.h>

#include "module.h"
#include "scenes.h"

namespace dyntape::python {
namespace {

using P = PythonProblem;
using Eigen::VectorXd;

void check_duration(const std::string& what, double duration) {
  if (duration > 0 && std::isfinite(duration)) return;
  throw ArgumentError(what + ": duration is " + io::shortest(duration) + " s; expected a positive number");
}

std::shared_ptr<P> problem_in(RobotScene scene, double duration, const std::string& form,
                              const std::string& unit) {
  check_duration("problem", duration);
  auto p = std::make_shared<P>();
  p->is_robot = true;
  p->scene = std::move(scene);
  p->options.duration = duration;
  p->options.form = io::chosen("problem: form", form, dynamics_forms());
  p->options.unit = io::chosen("problem: unit", unit, control_units());
  p->problem = robot_problem(p->scene, p->options);
  if (!p->scene.mimics.empty()) {
    p->tied = std::make_shared<const TiedJoints>(p->scene);
    p->problem = p->tied->shortened(p->problem);
  }
  return p;
}

std::shared_ptr<P> problem_of(std::shared_ptr<const Robot> robot, double duration, const std::string& form,
                              const std::string& unit, const std::vector<std::string>& driven) {
  RobotScene scene;
  scene.model = robot->model();
  scene.actuated = driven;
  scene.mimics = dynamics::resolved(robot->urdf.mimics);
  const auto p = problem_in(std::move(scene), duration, form, unit);
  p->visuals = [robot] { return robot->visuals(); };
  return p;
}

std::shared_ptr<P> problem_of_scene(std::shared_ptr<PythonScene> scene, std::optional<double> duration,
                                    const std::string& form, const std::string& unit) {
  const auto p = problem_in(scene->scene.robot, duration.value_or(scene->scene.duration), form, unit);
  const auto start = [&](Problem& problem) { start_at(problem, p->scene, scene->scene.q, scene->scene.v); };
  p->tied ? p->tied->set_ends(p->problem, start) : start(p->problem);
  p->visuals = [scene] {
    return scene->scene.urdf.empty() ? dynamics::UrdfVisuals()
                                     : dynamics::read_visuals(scene->scene.urdf, scene->scene.robot.model);
  };
  return p;
}

void add_parameters(P& p, nb::handle given) {
  if (given.is_none()) return;
  const nb::dict values = nb::cast<nb::dict>(given);
  for (const auto& [name, value] : values)
    p.problem.parameters.add(text_of(name, "parameters"), parameter_value(value, nb::none()));
}

void check_names(const std::string& name, const std::vector<std::string>& states,
                 const std::vector<std::string>& controls) {
  std::set<std::string> known;
  for (const auto* names : {&states, &controls})
    for (const std::string& one : *names)
      if (!known.insert(one).second)
        throw ArgumentError("Problem(\"" + name + "\"): \"" + one +
                            "\" is given twice, expected a name of its own for each state and control");
}

P own_problem(const std::string& name, const std::vector<std::string>& states,
              const std::vector<std::string>& controls, double duration, nb::callable rate,
              nb::handle parameters) {
  check_names(name, states, controls);
  check_duration("Problem(\"" + name + "\")", duration);
  P p;
  // The sizes first: the rate is recorded with them.
  p.problem = Problem(name, states, controls, duration, StageFunction([](const auto& s) { return s.x; }));
  add_parameters(p, parameters);
  const Parameters all = p.problem.parameters;
  const StageFunction recorded = record_stage_function(p, name + ": rate", rate);
  p.problem = Problem(name, states, controls, duration, recorded);
  p.problem.parameters = all;
  return p;
}

// --- Ends, bounds, guesses --------------------------------------------------------------------------------

VectorXd velocity_of(const P& p, nb::handle v) {
  return v.is_none() ? VectorXd::Zero(p.nv()).eval() : vector_of(v, "v", p.nv());
}

using SetEnd = void (*)(Problem&, const RobotScene&, const VectorXd&, const VectorXd&);

void set_end(const P& p, Problem& problem, SetEnd set, const VectorXd& q, const VectorXd& v) {
  if (!p.tied) return set(problem, p.scene, q, v);
  p.tied->set_ends(problem, [&](Problem& all) { set(all, p.scene, p.tied->all_q(q), p.tied->all_v(v)); });
}

void check_robot(const P& p, const char* what) {
  if (!p.is_robot)
    throw ArgumentError(std::string(what) + ": only for a robot's problem; set start and goal");
}

void start_at_state(P& p, nb::handle q, nb::handle v) {
  check_robot(p, "start_at");
  set_end(p, p.problem, start_at, vector_of(q, "q", p.nq()), velocity_of(p, v));
}

void end_at_state(P& p, nb::handle q, nb::handle v) {
  check_robot(p, "end_at");
  const VectorXd free = VectorXd::Constant(p.nq(), Problem::kFree);
  set_end(p, p.problem, end_at, q.is_none() ? free : vector_of(q, "q", p.nq()), velocity_of(p, v));
}

// The guess goes straight to these joints, whatever the goal gives.
void guess_towards(P& p, nb::handle q) {
  check_robot(p, "guess_towards");
  Problem ends = p.problem;
  set_end(p, ends, end_at, vector_of(q, "q", p.nq()), VectorXd::Zero(p.nv()));
  p.problem.guess = straight_line(ends), p.earlier = nullptr;
}

// Of a part of a stage over time: straight lines between rows, zeros where nothing is given.
std::function<VectorXd(double)> guessed_part(nb::handle given, nb::handle t, const std::string& what,
                                             Eigen::Index entries) {
  if (given.is_none()) return [entries](double) { return VectorXd(VectorXd::Zero(entries)); };
  const Numbers rows = numbers(given, what);
  const bool fits = rows.shape.size() == (t.is_none() ? 1 : 2) && rows.shape.back() == entries;
  if (!fits)
    throw ArgumentError(what + ": expected shape " + (t.is_none() ? "(" : "(times, ") +
                        std::to_string(entries) + (t.is_none() ? ",)" : ")") + ", got " +
                        shape_text(rows.shape));
  const ParameterValue value = parameter_value(given, t);
  if (value.of_time) return value.of_time;
  return [constant = value.constant](double) { return constant; };
}

// Straight lines between the points of an earlier solution; solve() without a mesh of its own also takes its mesh and multipliers.
void guess_solution(P& p, const ProblemSolution& earlier) {
  const Trajectory& motion = earlier.solution->motion;
  const double end = motion.t[motion.points() - 1], duration = p.problem.free_time ? end : p.problem.duration;
  p.problem.guess = [motion, scale = end / duration](double t) {
    const auto next = std::upper_bound(motion.t.begin(), motion.t.end(), t * scale);
    const Eigen::Index k = std::clamp(Eigen::Index(next - motion.t.begin()) - 1, Eigen::Index(0),
                                      Eigen::Index(motion.points()) - 2);
    const double share = std::clamp((t * scale - motion.t[k]) / (motion.t[k + 1] - motion.t[k]), 0.0, 1.0);
    const auto at = [&](const Eigen::MatrixXd& columns) {
      return VectorXd((1 - share) * columns.col(k) + share * columns.col(k + 1));
    };
    return Stage<double>{t, at(motion.x), at(motion.a), at(motion.u)};
  };
  p.problem.duration = duration;
  p.earlier = earlier.solution;
}

void guess(P& p, nb::handle x, nb::handle u, nb::handle a, nb::handle t) {
  const Problem& problem = p.problem;
  if (nb::isinstance<ProblemSolution>(x)) {
    if (!u.is_none() || !a.is_none() || !t.is_none())
      throw ArgumentError("guess: a Solution has its own u, a and t; expected nothing else");
    return guess_solution(p, nb::cast<const ProblemSolution&>(x));
  }
  p.earlier = nullptr;
  const auto part_x = guessed_part(x, t, "guess: x", problem.n_x());
  const auto part_u = guessed_part(u, t, "guess: u", problem.n_u());
  const auto part_a = guessed_part(a, t, "guess: a", problem.n_a());
  p.problem.guess = [=](double at) { return Stage<double>{at, part_x(at), part_a(at), part_u(at)}; };
}

nb::object of(const VectorXd& values) { return copy_of(values.data(), {values.size()}); }

void bound_part(Bounds& of_problem, const std::vector<std::string>& names, const std::string& what,
                nb::handle lower, nb::handle upper) {
  Bounds bounds = of_problem;
  const auto set = [&](VectorXd& side, nb::handle given) {
    if (given.is_none()) return;
    const Numbers values = numbers(given, what);
    if (values.shape.empty())
      side.setConstant(*values.data);
    else
      side = vector_of(given, what, side.size());
  };
  set(bounds.lower, lower);
  set(bounds.upper, upper);
  check_bounds(what, names, bounds.lower, bounds.upper);
  of_problem = bounds;
}

void check_range(double shortest, double longest) {
  if (shortest > 0 && shortest <= longest && std::isfinite(longest)) return;
  const bool is_first = !(shortest > 0 && std::isfinite(shortest));
  throw ArgumentError(std::string("free_duration: ") + (is_first ? "shortest" : "longest") + " is " +
                      io::shortest(is_first ? shortest : longest) + " s; expected " +
                      (is_first ? "a positive number" : "a number of at least " + io::shortest(shortest)));
}

std::string summary(const P& p) {
  std::string terms;
  for (const Term& term : p.problem.terms) terms += (terms.empty() ? "" : ", ") + term.name;
  return "<dyntape.Problem \"" + p.problem.name + "\": " + std::to_string(p.problem.n_x()) + " states, " +
         std::to_string(p.problem.n_u()) + " controls, " +
         (terms.empty() ? std::string("no terms") : "terms: " + terms) + ">";
}

std::string word_of(const Term& term) {
  return term.where == Where::kRunning ? "running"
                                       : name_of_instant(term.where == Where::kTerminal ? 1 : term.share);
}
std::string word_of(Role role) {
  constexpr const char* kWords[] = {"cost", "squares", "equality", "inequality"};
  return kWords[static_cast<int>(role)];
}

VectorXd end_of(const P& p, nb::handle x, const std::string& what) {
  if (x.is_none())
    throw ArgumentError(what + ": got None, expected an array of shape (" + std::to_string(p.problem.n_x()) +
                        ",); NaN is an entry that is free");
  const VectorXd end = vector_of(x, what, p.problem.n_x());
  for (Eigen::Index i = 0; i < end.size(); ++i) {
    if (std::isinf(end[i]))
      throw ArgumentError(what + ": " + p.problem.states[std::size_t(i)] + " is " + io::shortest(end[i]) +
                          "; expected a number, or NaN for a free entry");
  }
  return end;
}

void bind_ends(nb::class_<P>& problem) {
  problem
      .def_prop_ro(
          "name", [](const P& p) { return p.problem.name; }, "Its name.")
      .def_prop_ro(
          "states", [](const P& p) { return p.problem.states; }, "Names of the states.")
      .def_prop_ro(
          "controls", [](const P& p) { return p.problem.controls; }, "Names of the controls.")
      .def_prop_rw(
          "start", [](const P& p) { return of(p.problem.start); },
          [](P& p, nb::handle x) { p.problem.start = end_of(p, x, "start"); },
          nb::for_getter(nb::sig("def start(self) -> Array")),
          nb::for_setter(nb::sig("def start(self, x: ArrayLike, /) -> None")),
          nb::for_setter(nb::arg("x").none()), "(states,) where the motion begins; NaN: free.")
      .def_prop_rw(
          "goal", [](const P& p) { return of(p.problem.goal); },
          [](P& p, nb::handle x) { p.problem.goal = end_of(p, x, "goal"); },
          nb::for_getter(nb::sig("def goal(self) -> Array")),
          nb::for_setter(nb::sig("def goal(self, x: ArrayLike, /) -> None")),
          nb::for_setter(nb::arg("x").none()), "(states,) where it ends; NaN: free.")
      .def("start_at", start_at_state, nb::arg("q"), nb::arg("v") = nb::none(),
           nb::sig("def start_at(self, q: ArrayLike, v: ArrayLike | None = None) -> None"),
           "Begins at q (nq,), v (nv,), by default at rest; of a robot.")
      .def("end_at", end_at_state, nb::arg("q") = nb::none(), nb::arg("v") = nb::none(),
           nb::sig("def end_at(self, q: ArrayLike | None = None, v: ArrayLike | None = None) -> None"),
           "Ends at q (nq,), by default anywhere, with v (nv,), by default at rest; of a robot.")
      .def("guess_towards", guess_towards, nb::arg("q"),
           nb::sig("def guess_towards(self, q: ArrayLike) -> None"),
           "The first guess goes straight from the start to q (nq,), whatever the goal gives.")
      .def("guess", guess, nb::arg("x"), nb::arg("u") = nb::none(), nb::arg("a") = nb::none(), nb::kw_only(),
           nb::arg("t") = nb::none(),
           nb::sig("def guess(self, x: ArrayLike | Solution, u: ArrayLike | None = None, a: ArrayLike | None "
                   "= None, *, "
                   "t: ArrayLike | None = None) -> None"),
           "The first guess: x (states,), u (controls,), a (accelerations,) for all times, or with t (m,), "
           "s, a "
           "row for each of\n"
           "them, straight lines between; zeros where nothing is given.\n\n"
           "guess(solution) begins with an earlier solution of this problem, or of one whose values differ: "
           "solve() then starts on\n"
           "its mesh with its multipliers, and takes a few iterations.");
}

void bind_limits(nb::class_<P>& problem) {
  problem
      .def(
          "bound_states",
          [](P& p, nb::handle lower, nb::handle upper) {
            bound_part(p.problem.x, p.problem.states, "bound_states", lower, upper);
          },
          nb::arg("lower") = nb::none(), nb::arg("upper") = nb::none(),
          nb::sig("def bound_states(self, lower: ArrayLike | None = None, upper: ArrayLike | None = None) -> "
                  "None"),
          "Bounds at every point; a number is for all, None leaves this side as it is.")
      .def(
          "bound_controls",
          [](P& p, nb::handle lower, nb::handle upper) {
            bound_part(p.problem.u, p.problem.controls, "bound_controls", lower, upper);
          },
          nb::arg("lower") = nb::none(), nb::arg("upper") = nb::none(),
          nb::sig("def bound_controls(self, lower: ArrayLike | None = None, upper: ArrayLike | None = None) "
                  "-> None"),
          "Bounds at every point; a number is for all, None leaves this side as it is.")
      .def(
          "add_parameter",
          [](P& p, const std::string& name, nb::handle value, nb::handle times) {
            p.problem.parameters.add(name, parameter_value(value, times));
          },
          nb::arg("name"), nb::arg("value"), nb::arg("times") = nb::none(),
          nb::sig(
              "def add_parameter(self, name: str, value: ArrayLike, times: ArrayLike | None = None) -> None"),
          "What terms that are added later read as s[name] and what changes without another recording: a "
          "number or (n,).\n"
          "With times (m,), s, a function of time: value (m,) or (m, n), straight lines between, constant "
          "outside.")
      .def(
          "set_parameter",
          [](P& p, const std::string& name, nb::handle value, nb::handle times) {
            p.problem.parameters.set(name, parameter_value(value, times));
          },
          nb::arg("name"), nb::arg("value"), nb::arg("times") = nb::none(),
          nb::sig(
              "def set_parameter(self, name: str, value: ArrayLike, times: ArrayLike | None = None) -> None"),
          "Another value for a parameter.")
      .def(
          "free_duration",
          [](P& p, double shortest, double longest) {
            check_range(shortest, longest);
            p.problem.free_duration(shortest, longest);
          },
          nb::arg("shortest"), nb::arg("longest"),
          "Leaves the duration to the solver, between these bounds, s.")
      .def_prop_ro(
          "terms",
          [](const P& p) {
            nb::list rows;
            for (const Term& term : p.problem.terms)
              rows.append(nb::make_tuple(term.name, word_of(term), word_of(term.role)));
            return rows;
          },
          nb::sig("def terms(self) -> list[tuple[str, str, str]]"),
          "Name, place (\"running\", an instant) and role (\"cost\", \"squares\", \"equality\", "
          "\"inequality\") of each.")
      .def_prop_ro(
          "state_bounds",
          [](const P& p) { return nb::make_tuple(of(p.problem.x.lower), of(p.problem.x.upper)); },
          nb::sig("def state_bounds(self) -> tuple[Array, Array]"), "(states,) lower and upper ones.")
      .def_prop_ro(
          "control_bounds",
          [](const P& p) { return nb::make_tuple(of(p.problem.u.lower), of(p.problem.u.upper)); },
          nb::sig("def control_bounds(self) -> tuple[Array, Array]"), "(controls,) lower and upper ones.")
      .def("__repr__", summary)
      .def(
          "_repr_html_",
          [](nb::handle self) {
            return nb::module_::import_("dyntape._pictures").attr("problem_page")(self);
          },
          "States with bounds and ends, controls and terms, as tables.");
}

// Functions that were given may refer to the problem.
int traverse(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (!nb::inst_ready(self)) return 0;
  for (const P::Given& given : nb::inst_ptr<P>(self)->given) Py_VISIT(given.function.ptr());
  return 0;
}
int clear(PyObject* self) {
  if (nb::inst_ready(self)) nb::inst_ptr<P>(self)->given.clear();
  return 0;
}
PyType_Slot problem_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(traverse)},
                               {Py_tp_clear, reinterpret_cast<void*>(clear)},
                               {0, nullptr}};

}  // namespace

void check_bounds(const std::string& call, const std::vector<std::string>& names, const VectorXd& lower,
                  const VectorXd& upper) {
  for (Eigen::Index i = 0; i < lower.size(); ++i) {
    if (lower[i] <= upper[i] && lower[i] < HUGE_VAL && upper[i] > -HUGE_VAL) continue;
    const std::string name = lower.size() == std::ssize(names) ? names[std::size_t(i)]
                             : lower.size() == 1               ? ""
                                                               : "entry " + std::to_string(i);
    throw ArgumentError(call + ": " + (name.empty() ? "" : name + ": ") + "lower is " +
                        io::shortest(lower[i]) + ", upper is " + io::shortest(upper[i]) +
                        "; expected a lower bound of at most the upper, and below infinity");
  }
}

void check_intervals(int intervals) {
  if (intervals < 1)
    throw ArgumentError("intervals is " + std::to_string(intervals) + "; expected 1 or more");
}

StageSizes PythonProblem::sizes() const {
  StageSizes sizes{problem.n_x(), problem.n_a(), problem.n_u(), problem.parameters.size(), 0, 0};
  if (is_robot) sizes.nq = nq(), sizes.nv = nv();
  return sizes;
}

void bind_problems(nb::module_& module) {
  bind_stages(module);
  nb::class_<P> problem(
      module, "Problem", nb::type_slots(problem_slots),
      "An optimal control problem: what is minimised and demanded of a motion over time.\n\n"
      "robot.problem(duration=2) makes one of a robot; this class itself one of a dynamics of one's own:\n\n"
      ">>> p = dyntape.Problem(\"block\", [\"p\", \"v\"], [\"u\"], 1.0, lambda s: [s.x[1], s.u[0]])\n"
      ">>> p.add_squares(\"effort\", lambda s: s.u)\n"
      ">>> p.start, p.goal = [0, 0], [1, 0]\n"
      ">>> round(p.solve(10).cost, 9)\n"
      "12.0");
  problem.def(
      "__init__",
      [](P* self, const std::string& name, const std::vector<std::string>& states,
         const std::vector<std::string>& controls, double duration, nb::callable rate,
         nb::handle parameters) {
        new (self) P(own_problem(name, states, controls, duration, rate, parameters));
      },
      nb::arg("name"), nb::arg("states"), nb::arg("controls"), nb::arg("duration"), nb::arg("rate"),
      nb::kw_only(), nb::arg("parameters") = nb::none(),
      nb::sig(
          "def __init__(self, name: str, states: Sequence[str], controls: Sequence[str], duration: float, "
          "rate: Callable[[Stage], Any], *, parameters: Mapping[str, ArrayLike] | None = None) -> None"));
  problem.def("__copy__", [](const P& p) { return P(p); })
      .def(
          "__deepcopy__", [](const P& p, nb::handle) { return P(p); }, nb::arg("memo"));
  def_no_pickle(problem, "pass on the function that makes it");
  bind_ends(problem);
  bind_limits(problem);
  bind_terms(problem);
  bind_problem_solve(module, problem);
  bind_control(module);
  bind_ddp(module, problem);
  nb::object robot = module.attr("Robot");
  robot.attr("problem") = nb::cpp_function(
      problem_of, nb::name("problem"), nb::is_method(), nb::scope(robot), nb::arg("duration"), nb::kw_only(),
      nb::arg("form") = "forward", nb::arg("unit") = "physical",
      nb::arg("driven") = std::vector<std::string>(),
      nb::sig("def problem(self, duration: float, *, form: str = 'forward', unit: str = 'physical', "
              "driven: Sequence[str] = ()) -> Problem"),
      "An optimal control problem of this robot: state (q, v), controls at the driven joints.\n\n"
      "duration: s.  form: \"forward\" or \"inverse\" dynamics, the latter mostly faster.  unit of u: "
      "\"physical\", N m or\n"
      "N, or \"fraction\" of the effort limit.  driven: joints, by default all.\n\n"
      "Joints that follow others (load(..., mimic=True)) keep their rules and have no states or controls.");
  nb::object scene = module.attr("Scene");
  scene.attr("problem") = nb::cpp_function(
      problem_of_scene, nb::name("problem"), nb::is_method(), nb::scope(scene),
      nb::arg("duration") = nb::none(), nb::kw_only(), nb::arg("form") = "forward",
      nb::arg("unit") = "physical",
      nb::sig("def problem(self, duration: float | None = None, *, form: str = 'forward', unit: str = "
              "'physical') -> Problem"),
      "An optimal control problem of this scene: its robot, effects and driven joints, from its start.\n\n"
      "duration: s, by default the scene's; the rest as of Robot.problem.");
}

}  // namespace dyntape::python
