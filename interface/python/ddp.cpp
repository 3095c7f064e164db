// SPDX-License-Identifier: BSD-3-Clause
//
// Differential dynamic programming: one problem, or many of one structure side by side.
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/unique_ptr.h>

#include <algorithm>
#include <functional>
#include <mutex>
#include <numeric>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/batch/ddp_batch.h>
#include <dyntape/interface/io/choice.h>
#include <dyntape/interface/io/number.h>

#include "module.h"
#include "motions.h"
#include "problems.h"
#include "watch.h"

namespace dyntape::python {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

DdpOptions ddp_options(int intervals, const std::string& hessian, double tolerance, int max_iterations,
                       bool verify, const std::string& sensitivities) {
  check_intervals(intervals);
  DdpOptions options;
  options.evaluation.route = Route::kTiered;  // begins at once
  options.verify = verify;
  options.sensitivities = io::chosen<SensitivitiesOf>("sensitivities", sensitivities,
                                                      {{"none", SensitivitiesOf::kNothing},
                                                       {"cost", SensitivitiesOf::kCost},
                                                       {"motion", SensitivitiesOf::kMotion}});
  options.intervals = intervals;
  options.tolerance = tolerance;
  options.max_iterations = max_iterations;
  options.hessian = io::chosen<DdpHessian>(
      "hessian", hessian, {{"exact", DdpHessian::kExact}, {"gauss_newton", DdpHessian::kGaussNewton}});
  return options;
}

std::shared_ptr<DdpSolution> solve_ddp(const PythonProblem& p, int intervals, const std::string& hessian,
                                       double tolerance, int max_iterations, bool verify,
                                       const std::string& sensitivities, nb::handle progress) {
  DdpOptions options = ddp_options(intervals, hessian, tolerance, max_iterations, verify, sensitivities);
  warn_of_unmet_demands(p);
  try {
    return left_alone(nb::none(), progress, [problem = p.problem, options](const Watch& watch) mutable {
      options.stop = options.evaluation.stop = watch.stop;
      if (watch.tell)
        options.watch = [&](const DdpIteration& now) { watch.tell("cost " + io::with_digits(now.cost, 6)); };
      return std::make_shared<DdpSolution>(solve_with_ddp(problem, options));
    });
  } catch (const NumericalError& error) {
    throw_with_line(p, error);
  }
}

// --- One solution -----------------------------------------------------------------------------------------

// Row by row, as numpy has it.
double* write_rows(const MatrixXd& m, double* to) {
  for (Index i = 0; i < m.rows(); ++i)
    for (Index j = 0; j < m.cols(); ++j) *to++ = m(i, j);
  return to;
}

double* write_gains(const DdpSolution& s, double* to) {
  for (const LqrPolicy& policy : s.policy) to = write_rows(policy.K, to);
  return to;
}

nb::object gains_of(const DdpSolution& s) {
  double* to = nullptr;
  nb::object array = new_array({std::ptrdiff_t(s.policy.size()), s.u.rows(), s.x.rows()}, to);
  write_gains(s, to);
  return array;
}

// --- What solutions change by ------------------------------------------------------------------------------

// By parameters or by the start, of states, controls or cost.
struct Sensitivity {
  const char *name, *shape, *what;
  MotionDerivatives DdpSensitivities::*by;
  MatrixXd MotionDerivatives::*of;  // null: the cost
};
constexpr Sensitivity kSensitivities[] = {
    {"dx_dp", "N + 1, states, parameters", "what states change by with each entry of the parameters.",
     &DdpSensitivities::parameters, &MotionDerivatives::x},
    {"du_dp", "N, controls, parameters", "of the controls; zero where one is held at its limit.",
     &DdpSensitivities::parameters, &MotionDerivatives::u},
    {"dcost_dp", "parameters", "of the cost.", &DdpSensitivities::parameters, nullptr},
    {"dx_dstart", "N + 1, states, states", "what states change by with each state at the start.",
     &DdpSensitivities::start, &MotionDerivatives::x},
    {"du_dstart", "N, controls, states", "of the controls.", &DdpSensitivities::start, &MotionDerivatives::u},
    {"dcost_dstart", "states", "of the cost.", &DdpSensitivities::start, nullptr}};

// Rows of a matrix are entries of a node, node after node.
nb::object derivatives_of(const Sensitivity& which, const DdpSolution* first, std::size_t count,
                          Shape shape) {
  Index n_x = 0, n_u = 0, N = 0, columns = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const DdpSolution& s = first[i];
    const MotionDerivatives& by = s.sensitivities.*which.by;
    const MotionDerivatives& by_start = s.sensitivities.start;
    if (by_start.cost.size() == 0 || (which.of && by_start.x.size() == 0))
      throw MissingError(std::string(which.name) + ": not asked for; expected sensitivities=\"motion\"" +
                         (which.of ? "" : " or \"cost\"") + " of the solver");
    n_x = s.x.rows(), n_u = s.u.rows(), N = s.u.cols(), columns = by.cost.size();
  }
  if (which.of == &MotionDerivatives::x) shape.insert(shape.end(), {N + 1, n_x});
  if (which.of == &MotionDerivatives::u) shape.insert(shape.end(), {N, n_u});
  shape.push_back(columns);
  double* to = nullptr;
  nb::object array = new_array(shape, to);
  for (std::size_t i = 0; i < count; ++i) {
    const MotionDerivatives& by = first[i].sensitivities.*which.by;
    to = which.of ? write_rows(by.*which.of, to) : std::copy(by.cost.begin(), by.cost.end(), to);
  }
  return array;
}

std::string sensitivity_status(const DdpSolution& s) { return to_string(s.sensitivities.status); }

void bind_one_solution(nb::module_& module) {
  using S = DdpSolution;
  nb::class_<S> type(module, "DdpSolution", "A motion and the policy u = u_k + K_k (x - x_k) that keeps it.");
  type.def_prop_ro(
          "t", [](const S& s) { return entries_of(s.t); }, nb::sig("def t(self) -> Array"), "(N + 1,) s.")
      .def_prop_ro(
          "x", [](const S& s) { return rows_of(s.x); }, nb::sig("def x(self) -> Array"), "(N + 1, states).")
      .def_prop_ro(
          "u", [](const S& s) { return rows_of(s.u); }, nb::sig("def u(self) -> Array"),
          "(N, controls), held over each interval.")
      .def_prop_ro("K", gains_of, nb::sig("def K(self) -> Array"), "(N, controls, states).")
      .def_prop_ro(
          "slope", [](const S& s) { return rows_of(s.slope); }, nb::sig("def slope(self) -> Array"),
          "(N + 1, states), the gradient of the cost to go by the state.")
      .def_ro("cost", &S::cost, "What was minimised.")
      .def_prop_ro("success", &S::success,
                   "True if it converged to a minimum, the controls reproduce the motion, and the cost is "
                   "the sum over the steps.")
      .def_prop_ro("verdict", &S::verdict, "One sentence.")
      .def_prop_ro(
          "status", [](const S& s) { return to_string(s.status); }, "How the solver ended.")
      .def_prop_ro(
          "iterations", [](const S& s) { return s.iterations.size(); }, "Of the solver.")
      .def_ro("integration_error", &S::integration_error,
              "What the steps are off by, found by integrating to 1e-12.")
      .def_ro("seconds", &S::seconds, "s, of the iterations.")
      .def_ro("build_seconds", &S::build_seconds, "s, of recording and of making code.")
      .def("__repr__", [](const S& s) {
        return std::string("<dyntape.DdpSolution: ") + to_string(s.status) + " in " +
               std::to_string(s.iterations.size()) + " iterations, cost " + io::with_digits(s.cost, 6) + ">";
      });
  for (const Sensitivity& one : kSensitivities)
    def_array(type, one.name, kept(std::string("(") + one.shape + (one.of ? "), " : ",), ") + one.what),
              [&one](const S& s) { return derivatives_of(one, &s, 1, {}); });
  type.def_prop_ro(
      "sensitivity_status", sensitivity_status,
      "\"good\"; \"weakly active\": to either side of a limit it is another; \"no strict minimum\": of "
      "the motion NaN; \"not a solution\", \"not finite\": NaN.");
}

// --- Many -------------------------------------------------------------------------------------------------

struct DdpSolutions {
  std::vector<DdpSolution> all;
  Index n_x = 0, n_u = 0, N = 0;
  Index count() const { return Index(all.size()); }
};

// (count, ...): what `write` puts down of each.
template <class Write>
nb::object stacked(const DdpSolutions& s, Shape shape, const Write& write) {
  shape.insert(shape.begin(), s.count());
  double* to = nullptr;
  nb::object array = new_array(shape, to);
  for (const DdpSolution& one : s.all) to = write(one, to);
  return array;
}

const DdpSolution& solution_at(const DdpSolutions& s, std::ptrdiff_t i) {
  const std::ptrdiff_t at = i < 0 ? i + s.count() : i;
  if (at < 0 || at >= s.count())
    throw nb::index_error(
        ("problem " + std::to_string(i) + " of " + std::to_string(s.count()) + " solutions").c_str());
  return s.all[std::size_t(at)];
}

std::string summary(const DdpSolutions& s) {
  const auto solved =
      std::count_if(s.all.begin(), s.all.end(), [](const DdpSolution& one) { return one.success(); });
  return "<dyntape.DdpSolutions: " + std::to_string(solved) + " of " + std::to_string(s.count()) + " solved>";
}

void bind_many_solutions(nb::module_& module) {
  using S = DdpSolutions;
  nb::class_<S> type(module, "DdpSolutions",
                     "Of many problems, which come first in every array; s[i] is one DdpSolution.");
  def_array(type, "x", "(problems, N + 1, states).", [](const S& s) {
    return stacked(s, {s.N + 1, s.n_x},
                   [](const DdpSolution& one, double* to) { return write_rows(one.x.transpose(), to); });
  });
  def_array(type, "u", "(problems, N, controls).", [](const S& s) {
    return stacked(s, {s.N, s.n_u},
                   [](const DdpSolution& one, double* to) { return write_rows(one.u.transpose(), to); });
  });
  def_array(type, "K", "(problems, N, controls, states) gains.", [](const S& s) {
    return stacked(s, {s.N, s.n_u, s.n_x}, write_gains);
  });
  def_array(type, "slope", "(problems, states), the gradient of each cost by its start.", [](const S& s) {
    return stacked(s, {s.n_x},
                   [](const DdpSolution& one, double* to) { return write_rows(one.slope.col(0), to); });
  });
  for (const Sensitivity& one : kSensitivities)
    def_array(type, one.name, kept(std::string("(problems, ") + one.shape + "), " + one.what),
              [&one](const S& s) { return derivatives_of(one, s.all.data(), s.all.size(), {s.count()}); });
  def_array(type, "cost", "(problems,) what was minimised.", [](const S& s) {
    return stacked(s, {}, [](const DdpSolution& one, double* to) { return *to = one.cost, to + 1; });
  });
  type.def_prop_ro(
          "success",
          [](const S& s) {
            std::vector<bool> solved;
            for (const DdpSolution& one : s.all) solved.push_back(one.success());
            return nb::module_::import_("numpy").attr("array")(nb::cast(solved));
          },
          nb::sig("def success(self) -> NDArray[np.bool_]"), "(problems,) whether each was solved.")
      .def_prop_ro(
          "status",
          [](const S& s) {
            std::vector<std::string> status;
            for (const DdpSolution& one : s.all) status.push_back(to_string(one.status));
            return status;
          },
          "How the solver ended, of each.")
      .def_prop_ro(
          "verdict",
          [](const S& s) {
            std::vector<std::string> verdicts;
            for (const DdpSolution& one : s.all) verdicts.push_back(one.verdict());
            return verdicts;
          },
          "A sentence of each.")
      .def_prop_ro(
          "sensitivity_status",
          [](const S& s) {
            std::vector<std::string> status;
            for (const DdpSolution& one : s.all) status.push_back(sensitivity_status(one));
            return status;
          },
          "What derivatives are worth, of each.")
      .def_prop_ro(
          "iterations",
          [](const S& s) {
            std::vector<std::ptrdiff_t> counts;
            for (const DdpSolution& one : s.all) counts.push_back(std::ptrdiff_t(one.iterations.size()));
            return new_integers(counts);
          },
          nb::sig("def iterations(self) -> IntArray"), "(problems,) of the solver.")
      .def_prop_ro(
          "seconds",
          [](const S& s) {
            double sum = 0;
            for (const DdpSolution& one : s.all) sum += one.seconds;
            return sum;
          },
          "s, of all.")
      .def("__len__", &S::count)
      .def("__getitem__", solution_at, nb::arg("i"), nb::rv_policy::copy)
      .def("__repr__", summary);
}

// --- The solver -------------------------------------------------------------------------------------------

struct PythonDdp {
  PythonDdp(const PythonProblem& p, const DdpOptions& options, unsigned threads)
      : batch(p.problem, options, threads), intervals(options.intervals) {}
  DdpBatch batch;
  int intervals;
  std::mutex mutex;  // one call at a time
};

std::unique_ptr<PythonDdp> make_ddp(const PythonProblem& p, int intervals, const std::string& hessian,
                                    double tolerance, int max_iterations, bool verify,
                                    const std::string& sensitivities, bool portable, unsigned threads) {
  DdpOptions options = ddp_options(intervals, hessian, tolerance, max_iterations, verify, sensitivities);
  if (portable) options.evaluation.functions = Functions::kPortable;
  return watched(nb::none(), [&](const Watch&) { return std::make_unique<PythonDdp>(p, options, threads); });
}

// (count, ...) as (entries x count).
MatrixXd columns_of(nb::handle given, const std::string& what, const Shape& entries) {
  if (given.is_none()) return {};
  Shape expected = entries;
  expected.insert(expected.begin(), -1);
  const Numbers n = numbers(given, what, expected);
  const Index rows = std::accumulate(entries.begin(), entries.end(), Index(1), std::multiplies<>());
  return Eigen::Map<const MatrixXd>(n.data, rows, n.shape[0]);
}

// Those that are not named keep their value, which must not vary with time.
MatrixXd parameter_columns(const Problem& problem, nb::handle given) {
  if (given.is_none()) return {};
  if (!nb::isinstance<nb::dict>(given))
    throw nb::type_error("solve_batch: parameters: expected a dict of arrays by name");
  if (const std::string varies = problem.parameters.first_of_time(); !varies.empty())
    throw ArgumentError("solve_batch: parameters: \"" + varies +
                        "\" is a function of time, and values of a batch are held");
  MatrixXd columns;
  for (auto [key, value] : nb::cast<nb::dict>(given)) {
    const std::string name = text_of(key, "solve_batch: parameters");
    const Parameter place = problem.parameters.find(name);
    Numbers n = numbers(value, "solve_batch: parameter \"" + name + "\"");
    if (n.shape.size() == 1 && place.size() == 1) n.shape.push_back(1);
    if (n.shape.size() != 2 || n.shape[1] != place.size() ||
        (columns.cols() > 0 && columns.cols() != n.shape[0]))
      throw ArgumentError("solve_batch: parameter \"" + name + "\": expected an array of shape (" +
                          (columns.cols() > 0 ? std::to_string(columns.cols()) : "problems") + ", " +
                          std::to_string(place.size()) + "), got " + shape_text(n.shape));
    if (columns.cols() == 0) columns = problem.parameters.at(0).replicate(1, n.shape[0]);
    columns.middleRows(place.first(), place.size()) =
        Eigen::Map<const MatrixXd>(n.data, place.size(), n.shape[0]);
  }
  return columns;
}

std::unique_ptr<DdpSolutions> solve_batch(PythonDdp& self, nb::handle starts, nb::handle parameters,
                                          nb::handle controls) {
  const Problem& problem = self.batch.solver().problem();
  const Index n_x = problem.n_x(), n_u = problem.n_u(), N = self.intervals;
  DdpBatchValues values{columns_of(starts, "solve_batch: starts", {n_x}),
                        parameter_columns(problem, parameters),
                        columns_of(controls, "solve_batch: controls", {N, n_u})};
  return watched(nb::none(), [&](const Watch& watch) {
    const std::scoped_lock lock(self.mutex);
    return std::make_unique<DdpSolutions>(DdpSolutions{self.batch.solve(values, watch.stop), n_x, n_u, N});
  });
}

std::shared_ptr<DdpSolution> solve_one(PythonDdp& self, nb::handle start) {
  Problem now = self.batch.solver().problem();
  if (!start.is_none()) now.start = vector_of(start, "solve: start", now.n_x());
  return watched(nb::none(), [&](const Watch& watch) {
    const std::scoped_lock lock(self.mutex);
    self.batch.solver().set_values(now);
    return std::make_shared<DdpSolution>(self.batch.solver().solve(watch.stop));
  });
}

void bind_solver(nb::module_& module) {
  auto type =
      nb::class_<PythonDdp>(
          module, "Ddp",
          "Differential dynamic programming of a problem that is recorded and compiled once: "
          "`Problem.ddp()`.\n\nOne thread at a time solves; others wait.")
          .def("solve", solve_one, nb::arg("start") = nb::none(),
               nb::sig("def solve(self, start: ArrayLike | None = None) -> DdpSolution"),
               "From the start (states,); where it is left out, from the last one.")
          .def("solve_batch", solve_batch, nb::arg("starts") = nb::none(), nb::kw_only(),
               nb::arg("parameters") = nb::none(), nb::arg("controls") = nb::none(),
               nb::sig("def solve_batch(self, starts: ArrayLike | None = None, *, parameters: Mapping[str, "
                       "ArrayLike] | None = "
                       "None, controls: ArrayLike | None = None) -> DdpSolutions"),
               "Many problems side by side: one a lane of the processor's registers, and in threads.\n\n"
               "starts: (problems, states).  parameters: by name, (problems,) or (problems, entries), held "
               "over "
               "time.\n"
               "controls: (problems, N, controls), first guesses.  What is left out is the problem's own.\n"
               "Each solution has the bits that it has alone.  One that fails is a status of its own.")
          .def(
              "set_parameter",
              [](PythonDdp& self, const std::string& name, nb::handle value, nb::handle times) {
                const ParameterValue now = parameter_value(value, times);
                const nb::gil_scoped_release unlocked;
                const std::scoped_lock lock(self.mutex);
                Problem next = self.batch.solver().problem();
                next.parameters.set(name, now);
                self.batch.solver().set_values(next);
              },
              nb::arg("name"), nb::arg("value"), nb::arg("times") = nb::none(),
              nb::sig("def set_parameter(self, name: str, value: ArrayLike, times: ArrayLike | None = None) "
                      "-> None"),
              "Another value for a parameter, from the next solve on.")
          .def_prop_ro(
              "lanes", [](const PythonDdp& self) { return self.batch.lanes(); },
              "Problems side by side in a thread.")
          .def_prop_ro(
              "parameters",
              [](const PythonDdp& self) { return self.batch.solver().problem().parameters.entry_names(); },
              "Names of the entries that derivatives are by.")
          .def("__repr__", [](const PythonDdp& self) {
            return "<dyntape.Ddp of \"" + self.batch.solver().problem().name + "\", " +
                   std::to_string(self.intervals) + " intervals>";
          });
  def_no_pickle(type, "pass on the Problem's function and its values, and make another Ddp there");
}

}  // namespace

void bind_ddp(nb::module_& module, nb::class_<PythonProblem>& problem) {
  bind_one_solution(module);
  bind_many_solutions(module);
  bind_solver(module);
  problem.def(
      "solve_ddp", solve_ddp, nb::arg("intervals") = 100, nb::kw_only(), nb::arg("hessian") = "exact",
      nb::arg("tolerance") = 1e-9, nb::arg("max_iterations") = 500, nb::arg("verify") = true,
      nb::arg("sensitivities") = "none", nb::arg("progress") = nb::none(),
      nb::sig(
          "def solve_ddp(self, intervals: int = 100, *, hessian: str = 'exact', tolerance: float = 1e-09, "
          "max_iterations: int = 500, verify: bool = True, sensitivities: str = 'none', progress: Progress = "
          "None) "
          "-> DdpSolution"),
      "Solves by differential dynamic programming: costs and limits of controls, from a given start.\n\n"
      "Controls are held over each interval, one step of the classical Runge-Kutta scheme.\n"
      "verify: finds `integration_error`, which may take longer than the solve.\n"
      "sensitivities: \"cost\" gives `dcost_dp` and `dcost_dstart`, \"motion\" also `dx_dp`, `du_dp`, "
      "`dx_dstart` and\n"
      "`du_dstart`, exact with either kind of Hessian; their functions are made besides.\n"
      "Raises ArgumentError for what the method does not know, as goals and path constraints.");
  problem.def(
      "ddp", make_ddp, nb::arg("intervals") = 100, nb::kw_only(), nb::arg("hessian") = "exact",
      nb::arg("tolerance") = 1e-9, nb::arg("max_iterations") = 500, nb::arg("verify") = false,
      nb::arg("sensitivities") = "none", nb::arg("portable") = true, nb::arg("threads") = 1,
      nb::sig("def ddp(self, intervals: int = 100, *, hessian: str = 'exact', tolerance: float = 1e-09, "
              "max_iterations: int = 500, verify: bool = False, sensitivities: str = 'none', portable: bool "
              "= True, "
              "threads: int = 1) -> Ddp"),
      "A solver for many starts and parameters, one after another or side by side; as `solve_ddp`.\n\n"
      "portable: sine, cosine and their like of dyntape's own, quick in lanes and the same on every "
      "processor;\n"
      "otherwise the C library's.  threads: that share a batch; 0: as many as the process has.");
}

}  // namespace dyntape::python
