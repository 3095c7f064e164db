// SPDX-License-Identifier: BSD-3-Clause
//
// Problems as controllers: model predictive control.
#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/printed/controller.h>
#include <dyntape/interface/io/number.h>

#include "motions.h"
#include "problems.h"
#include "problems/sensitivities.h"
#include "watch.h"

namespace dyntape::python {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct PythonMpc {
  PythonMpc(const Problem& problem, const MpcOptions& options) : mpc(problem, options), mesh(options.mesh) {}
  RecedingHorizon mpc;
  MeshOptions mesh;
  Trajectory plan;                                 // of the last step
  std::optional<MotionSensitivity> sensitivities;  // made at the first call
  std::mutex mutex;                                // one step at a time
};

void refuse_plain_costs(const Problem& problem) {
  for (const Term& term : problem.terms) {
    if (term.role != Role::kCost || !term.curvature.empty()) continue;
    throw ArgumentError(
        "Mpc: \"" + term.name +
        "\" is a plain cost (add_cost); expected squares of residuals (add_squares), whose curvature a "
        "controller uses");
  }
}

void make_mpc(PythonMpc* self, const PythonProblem& p, int intervals, const std::string& scheme,
              int iterations, bool gains, double tolerance, bool printed) {
  check_intervals(intervals);
  refuse_plain_costs(p.problem);
  MpcOptions options;
  options.mesh.intervals = intervals;
  options.mesh.scheme = scheme_by_name(scheme);
  options.solver.tolerance = tolerance;
  options.iterations = iterations;
  options.gains = gains;
  options.printed = printed;
  bool is_made = false;
  try {
    watched(nb::none(), [&](const Watch& watch) {
      options.mesh.evaluation.stop = watch.stop;
      new (self) PythonMpc(p.problem, options);
      is_made = true;
    });
  } catch (...) {  // interrupted at the last moment
    if (is_made) self->~PythonMpc();
    throw;
  }
}

nb::dict generate(PythonMpc& self, const std::filesystem::path& folder, const std::string& name, bool single,
                  int iterations, std::size_t target_bytes) {
  ControllerOptions options;
  options.mesh = self.mesh;
  options.name = name;
  options.single = single;
  options.iterations = iterations;
  options.target_bytes = target_bytes;
  const PrintedController c = watched(nb::none(), [&](const Watch&) {
    const std::scoped_lock lock(self.mutex);
    return generate_controller(self.mpc.values(), options);
  });
  nb::dict report;
  report["name"] = c.name;
  report["files"] = write_source(c.source, folder.string());
  report["state_bytes"] = c.state_bytes;
  report["constant_bytes"] = c.constant_bytes;
  report["stack_bound"] = c.stack_bytes;
  report["iteration_bound"] = c.of_iteration.sum();
  return report;
}

MpcStep step(PythonMpc& self, double t, nb::handle x) {
  const Problem& problem = self.mpc.values();
  const VectorXd at = vector_of(x, "step: x", problem.n_x());
  for (Eigen::Index i = 0; i < at.size(); ++i)
    if (!std::isfinite(at[i]))
      throw ArgumentError("step: x: " + problem.states[std::size_t(i)] + " is " + io::shortest(at[i]) +
                          "; expected a number");
  const nb::gil_scoped_release unlocked;
  const std::scoped_lock lock(self.mutex);
  const MpcStep& now = self.mpc.step(t, at);
  self.plan = now.plan.motion;
  return now;
}

ProblemSensitivities sensitivities_of(PythonMpc& self) {
  return watched(nb::none(), [&](const Watch& watch) -> ProblemSensitivities {
    const std::scoped_lock lock(self.mutex);
    const NlpSolution solution = self.mpc.solution();
    if (!self.sensitivities) {
      self.mesh.evaluation.route = Route::kTiered;
      self.mesh.evaluation.stop = watch.stop;
      self.sensitivities.emplace(self.mpc.problem(), self.mesh);
    }
    return {self.sensitivities->at(self.mpc.problem(), solution), self.plan, self.mpc.problem()};
  });
}

nb::object control_at(const MpcStep& s, double t, nb::handle x) {
  if (x.is_none()) return entries_of(s.plan.control(t));
  return entries_of(s.plan.control(t, vector_of(x, "control: x", s.plan.motion.x.rows())));
}

void bind_step(nb::module_& module) {
  using S = MpcStep;
  nb::class_<S>(module, "MpcStep", "What one step of a controller came to: the plan from now on.")
      .def("control", control_at, nb::arg("t"), nb::arg("x") = nb::none(),
           nb::sig("def control(self, t: float, x: ArrayLike | None = None) -> Array"),
           "(controls,) at the plant's time t, s; with a measured x (states,) corrected by the plan's gain, "
           "if it has one.")
      .def_prop_ro(
          "t", [](const S& s) { return entries_of(s.plan.motion.t.array() + s.plan.begin); },
          nb::sig("def t(self) -> Array"), "(points,) s, the plant's time.")
      .def_prop_ro(
          "x", [](const S& s) { return rows_of(s.plan.motion.x); }, nb::sig("def x(self) -> Array"),
          "(points, states) of the plan.")
      .def_prop_ro(
          "u", [](const S& s) { return rows_of(s.plan.motion.u); }, nb::sig("def u(self) -> Array"),
          "(points, controls) of the plan.")
      .def_ro("usable", &S::usable, "Whether the plan may be followed.")
      .def_prop_ro(
          "status", [](const S& s) { return to_string(s.status); }, "How the solver ended.")
      .def_ro("iterations", &S::iterations, "Of the solver.")
      .def_ro("cost", &S::cost, "Of the plan.")
      .def_ro("violation", &S::violation, "Of the plan, relative to nominal values.")
      .def_ro("seconds", &S::seconds, "From the call to the plan.")
      .def("__repr__", [](const S& s) {
        return std::string("<dyntape.MpcStep: ") + (s.usable ? "usable" : "not usable") + ", " +
               to_string(s.status) + ", " + io::with_digits(1e3 * s.seconds, 3) + " ms>";
      });
}

void bind_mpc(nb::module_& module) {
  bind_step(module);
  auto type =
      nb::class_<PythonMpc>(
          module, "Mpc",
          "Model predictive control: a Problem solved again and again from where the plant is.\n\n"
          "The problem's duration is the horizon; it is recorded and compiled once.\n\n"
          "intervals, scheme: of the mesh.  iterations: of a step at most; 0: until it is solved, 1: the "
          "real-time\n"
          "iteration.  gains: plans have feedback.  tolerance: of a step that is solved, relative.  printed: "
          "steps run the text\n"
          "that generate() writes, compiled here.\n\n"
          "Raises ArgumentError for a problem whose start or duration is free, or whose costs are no "
          "squares.")
          .def("__init__", make_mpc, nb::arg("problem"), nb::kw_only(), nb::arg("intervals") = 20,
               nb::arg("scheme") = "trapezoid", nb::arg("iterations") = 0, nb::arg("gains") = false,
               nb::arg("tolerance") = 1e-6, nb::arg("printed") = false,
               nb::sig(
                   "def __init__(self, problem: Problem, *, intervals: int = 20, scheme: str = 'trapezoid', "
                   "iterations: int = 0, gains: bool = False, tolerance: float = 1e-06, printed: bool = "
                   "False) -> None"))
          .def("generate", generate, nb::arg("folder"), nb::kw_only(), nb::arg("name") = "",
               nb::arg("single") = false, nb::arg("iterations") = 50, nb::arg("target_bytes") = 0,
               nb::sig("def generate(self, folder: str | os.PathLike[str], *, name: str = '', single: bool = "
                       "False, iterations: int = 50, target_bytes: int = 0) -> dict[str, Any]"),
               "Writes this controller as folder/name.c and .h for a microcontroller: C99 without heap, "
               "recursion, libraries or\n"
               "static variables.  The scheme has to be euler, semi-implicit-euler, runge-kutta-4 or "
               "runge-kutta-4x<steps>.\n\n"
               "name: of its functions; empty: the problem's.  single: float instead of double.  iterations: "
               "most of a step.\n"
               "target_bytes: refuse what takes more; 0: any.  Returns files, state_bytes, constant_bytes, "
               "stack_bound and\n"
               "iteration_bound, the operations, loads, stores and turns of an iteration.\n\n"
               "Raises ArgumentError, naming the part, for what cannot be printed.")
          .def(
              "step", step, nb::arg("t"), nb::arg("x"),
              nb::sig("def step(self, t: float, x: ArrayLike) -> MpcStep"),
              "Plans from the state x (states,), measured at the plant's time t, s, which does not go back.  "
              "One thread at a time\n"
              "plans; others wait.")
          .def(
              "sensitivities", sensitivities_of, nb::sig("def sensitivities(self) -> Sensitivities"),
              "Derivatives of the last step's plan by the state that was measured and by the problem's "
              "parameters.\n\n"
              "du_dstart[0] and gain are of the first control by the measured state, du_dp[0] of the first "
              "control by the\n"
              "parameters; rows are the points of the plan, at the plant's times step.t.  Second derivatives "
              "are exact,\n"
              "also if the controller uses Gauss-Newton Hessians.  The derivative by a parameter of time is "
              "by a constant that\n"
              "is added to it.  The first call records and compiles.\n\n"
              "good is False and the arrays are NaN for a plan that is no solution, such as one of a "
              "real-time iteration\n"
              "(iterations=1) that has not converged; `why` says so.\n"
              "Raises ArgumentError before the first step, and for parameters of time with multiple "
              "shooting.\n\n"
              ">>> p = dyntape.Problem(\"block\", [\"p\", \"v\"], [\"u\"], 1.0, lambda s: [s.x[1], "
              "s.u[0]])\n"
              ">>> p.add_squares(\"effort\", lambda s: s.u)\n"
              ">>> p.start, p.goal = [0, 0], [1, 0]\n"
              ">>> mpc = dyntape.Mpc(p, scheme=\"hermite-simpson\", tolerance=1e-10)\n"
              ">>> step = mpc.step(0.0, [0.2, 0.0])\n"
              ">>> round(float(mpc.sensitivities().gain[0, 0]), 6)       # du(0)/dp(0)\n"
              "-6.0")
          .def(
              "set_parameter",
              [](PythonMpc& self, const std::string& name, nb::handle value, nb::handle times) {
                const ParameterValue now = parameter_value(value, times);
                const nb::gil_scoped_release unlocked;
                const std::scoped_lock lock(self.mutex);
                self.mpc.values().parameters.set(name, now);
              },
              nb::arg("name"), nb::arg("value"), nb::arg("times") = nb::none(),
              nb::sig("def set_parameter(self, name: str, value: ArrayLike, times: ArrayLike | None = None) "
                      "-> None"),
              "Another value for a parameter of the problem, from the next step on; times are the plant's.")
          .def("__repr__", [](PythonMpc& self) {
            return "<dyntape.Mpc of \"" + self.mpc.values().name + "\", horizon " +
                   io::shortest(self.mpc.values().duration) + " s>";
          });
  def_no_pickle(type, "pass on the Problem's function and its values, and make another Mpc there");
}

// Straight lines between rows, constant outside.
ParameterValue table_value(const Numbers& values, const VectorXd& times) {
  const Eigen::Index n = times.size(), entries = values.shape.size() == 1 ? 1 : values.shape[1];
  const MatrixXd columns = Eigen::Map<const MatrixXd>(values.data, entries, n);
  return ParameterValue([columns, times](double t) -> VectorXd {
    const double* after = std::upper_bound(times.data(), times.data() + times.size(), t);
    const Eigen::Index k = after - times.data();
    if (k == 0) return columns.col(0);
    if (k == times.size()) return columns.col(k - 1);
    const double share = (t - times[k - 1]) / (times[k] - times[k - 1]);
    return columns.col(k - 1) + share * (columns.col(k) - columns.col(k - 1));
  });
}

}  // namespace

ParameterValue parameter_value(nb::handle value, nb::handle times) {
  const Numbers values = numbers(value, "parameter: value");
  if (times.is_none()) {
    if (values.shape.empty()) return *values.data;
    return vector_of(value, "parameter: value", values.shape[0]);
  }
  const Numbers at = numbers(times, "parameter: times", {-1});
  const VectorXd t = VectorXd::Map(at.data, at.shape[0]);
  const bool fits = (values.shape.size() == 1 || values.shape.size() == 2) && values.shape[0] == at.shape[0];
  if (!fits || t.size() == 0)
    throw ArgumentError("parameter: expected a row of values for each of the " + std::to_string(t.size()) +
                        " times, got values of shape " + shape_text(values.shape));
  if (!std::is_sorted(t.begin(), t.end(), std::less_equal<double>()))
    throw ArgumentError("parameter: expected times that increase");
  return table_value(values, t);
}

void bind_control(nb::module_& module) { bind_mpc(module); }

}  // namespace dyntape::python
