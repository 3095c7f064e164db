// SPDX-License-Identifier: BSD-3-Clause
//
// A problem solved and verified, as Python has it.
#include <algorithm>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/nlp/solver_option_table.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/player/player.h>

#include "../keywords.h"
#include "../module.h"
#include "../motions.h"
#include "../problems.h"
#include "../watch.h"

namespace dyntape::python {
namespace {

std::string words_of(const IterationRecord& now) {
  return "iteration " + std::to_string(now.iteration) + ", cost " + io::with_digits(now.objective, 6) +
         ", violation " + io::with_digits(now.primal_infeasibility, 2);
}

std::shared_ptr<ProblemSolution> solve_problem(std::shared_ptr<PythonProblem> p, std::optional<int> intervals,
                                               const std::optional<std::string>& scheme,
                                               const std::string& hessian, const std::string& method,
                                               std::optional<bool> refine, bool compile, nb::handle progress,
                                               const nb::kwargs& more) {
  if (intervals) check_intervals(*intervals);
  SolveOptions options;
  KeywordOptions given("solve", nb::type<PythonProblem>().attr("solve"), nb::find(p), more);
  visit_options(options.solver, given);
  given.finish();
  if (scheme)
    options.mesh.scheme = scheme_by_name(*scheme);
  else if (intervals)
    options.mesh.scheme = hermite_simpson();
  const bool spans_all = options.mesh.scheme.spans_all;
  options.mesh.intervals = intervals.value_or(spans_all ? 1 : options.mesh.intervals);
  if (!intervals && !scheme) options.warm = p->earlier;
  options.mesh.hessian = io::chosen("solve: hessian", hessian, hessian_kinds());
  options.mesh.evaluation.route = compile ? Route::kTiered : Route::kInterpreter;
  options.solver.method = io::chosen("solve: method", method, nlp_methods());
  const bool is_refined = refine.value_or(!intervals) && !spans_all;
  if (!is_refined) options.refinements = 0, options.is_graded = false;
  warn_of_unmet_demands(*p);
  Problem problem = p->problem;
  Solution solution;
  try {
    solution = left_alone(nb::none(), progress, [problem, options](const Watch& watch) mutable {
      options.solver.stop = options.mesh.evaluation.stop = watch.stop;
      if (watch.tell) options.solver.watch = [&](const IterationRecord& now) { watch.tell(words_of(now)); };
      return solve(problem, options);
    });
  } catch (const NumericalError& error) {
    throw_with_line(*p, error);
  }
  const StageSizes sizes = p->sizes();
  const auto of = std::make_shared<PythonProblem>(*p);
  of->given.clear();
  return std::shared_ptr<ProblemSolution>(
      new ProblemSolution{of, std::move(problem), std::make_shared<const Solution>(std::move(solution)),
                          static_cast<int>(sizes.nq), static_cast<int>(sizes.nv)});
}

nb::object rows_of_state(const ProblemSolution& s, int first, int count, const char* what) {
  if (!s.of->is_robot) throw MissingError(std::string(what) + ": only for a robot's problem; expected x");
  return rows_of(s.solution->motion.x.middleRows(first, count));
}

std::string page(const ProblemSolution& s) {
  if (!s.of->is_robot) throw ArgumentError("page: only for a robot's problem; there is nothing to draw");
  PlayerInput input;
  input.title = s.problem.name;
  input.model = s.of->scene.model;
  input.visuals = s.of->visuals();
  input.t = s.solution->motion.t;
  input.q = s.solution->motion.x.topRows(s.nq);
  if (s.of->tied) {
    Eigen::MatrixXd all(input.model.nq, input.q.cols());
    for (Eigen::Index k = 0; k < all.cols(); ++k) all.col(k) = s.of->all_q(input.q.col(k));
    input.q = all;
  }
  return player_page(input);
}

std::string verdict(const ProblemSolution& s) { return s.solution->verdict(); }

nb::list meshes(const ProblemSolution& s) {
  nb::list rows;
  for (const MeshRound& m : s.solution->meshes) {
    nb::dict row;
    row["intervals"] = m.intervals, row["iterations"] = m.iterations, row["cost"] = m.cost;
    row["status"] = to_string(m.status), row["defect"] = m.relative_defect;
    row["passed"] = m.passed, row["cost_error"] = m.cost_error, row["seconds"] = m.seconds;
    rows.append(row);
  }
  return rows;
}

nb::list attempts(const ProblemSolution& s) {
  nb::list rows;
  for (const SolveAttempt& a : s.solution->nlp.attempts) {
    nb::dict row;
    row["method"] = to_string(a.method), row["start"] = a.start, row["iterations"] = a.iterations;
    row["status"] = to_string(a.status), row["cost"] = a.objective;
    rows.append(row);
  }
  return rows;
}

nb::list passings(const ProblemSolution& s) {
  nb::list rows;
  for (const Passing& p : s.solution->verification.passings.rows) rows.append(p.text());
  return rows;
}

nb::dict multipliers(const ProblemSolution& s) {
  const NlpSolution& nlp = s.solution->nlp;
  nb::dict parts;
  parts["rows"] = entries_of(nlp.lambda);
  parts["lower"] = entries_of(nlp.lower_multiplier), parts["upper"] = entries_of(nlp.upper_multiplier);
  return parts;
}

// The motion at some times, as a namespace of arrays: without the axis of times for a single one.
nb::object at(const ProblemSolution& s, nb::handle given) {
  const Numbers times = numbers(given, "at: t");
  if (times.shape.size() > 1)
    throw ArgumentError("at: t: expected a time or shape (times,), got " + shape_text(times.shape));
  const Trajectory& motion = s.solution->motion;
  if (motion.points() == 0) throw ArgumentError("at: the solution has no motion");
  const double end = motion.t[motion.points() - 1], slack = 1e-9 * end;
  std::vector<double> t(times.data, times.data + times.size());
  for (double& time : t) {
    if (!(time >= -slack && time <= end + slack))
      throw ArgumentError("at: the motion lasts from 0 to " + io::with_digits(end, 9) + " s, got " +
                          io::shortest(time));
    time = std::clamp(time, 0.0, end);
  }
  const Trajectory found = resampled(s.problem, motion, t);
  const bool is_one = times.shape.empty();
  const auto of = [&](const Eigen::MatrixXd& columns) {
    return is_one ? entries_of(Eigen::VectorXd(columns.col(0))) : rows_of(columns);
  };
  nb::object result = nb::module_::import_("types").attr("SimpleNamespace")();
  nb::setattr(result, "t", is_one ? nb::cast(t.front()) : entries_of(t));
  nb::setattr(result, "x", of(found.x)), nb::setattr(result, "a", of(found.a)),
      nb::setattr(result, "u", of(found.u));
  if (s.of->is_robot) {
    nb::setattr(result, "q", of(found.x.topRows(s.nq)));
    nb::setattr(result, "v", of(found.x.bottomRows(s.nv)));
  }
  return result;
}

std::string summary(const ProblemSolution& s) {
  return "<dyntape.Solution of \"" + s.problem.name + "\": " + verdict(s) + ", cost " +
         io::with_digits(s.solution->cost(), 6) + ", " + std::to_string(s.solution->motion.points()) +
         " points, " + std::to_string(s.solution->iterations()) + " iterations>";
}

nb::object in_pictures(const char* what, nb::handle self) {
  return nb::module_::import_("dyntape._pictures").attr(what)(self);
}

void bind_motion(nb::class_<ProblemSolution>& type) {
  using S = ProblemSolution;
  type.def_prop_ro(
          "states", [](const S& s) { return s.problem.states; }, "Names of the columns of x.")
      .def_prop_ro(
          "controls", [](const S& s) { return s.problem.controls; }, "Names of the columns of u.")
      .def("at", at, nb::arg("t"), nb::sig("def at(self, t: ArrayLike) -> types.SimpleNamespace"),
           "The motion between its points: x (states,), u (controls,), a (accelerations,), of a robot q and "
           "v; for t (m,), s, a "
           "row each.\n\n"
           "States follow cubics, controls and accelerations the scheme's polynomials, within limits.")
      .def(
          "plot", [](nb::handle self) { return in_pictures("plot_of", self); },
          nb::sig("def plot(self) -> Any"),
          "States and controls over time: a matplotlib Figure.\n\nRaises ImportError without matplotlib.")
      .def(
          "page", [](const S& s) { return made_page(s, page); },
          "The motion in 3D, an HTML page; of a robot's problem.")
      .def(
          "_repr_html_",
          [](nb::handle self) {
            const S& s = nb::cast<const S&>(self);
            const std::string table = nb::cast<std::string>(in_pictures("meshes_of", self));
            return s.of->is_robot ? in_notebook(made_page(s, page)) + table : table;
          },
          "The verdict and a table of the meshes; of a robot's problem the page as well.")
      .def("__repr__", summary)
      .def("__copy__", [](nb::object self) { return self; })
      .def(
          "__deepcopy__", [](nb::object self, nb::handle) { return self; }, nb::arg("memo"));
  def_no_pickle(type, "pass on its arrays t, x, u and a: problem.guess(x, u, a, t=t) begins with them");
}

void bind_found(nb::class_<ProblemSolution>& type) {
  using S = ProblemSolution;
  type.def_prop_ro(
          "cost", [](const S& s) { return s.solution->cost(); }, "What was minimised.")
      .def_prop_ro(
          "success", [](const S& s) { return s.solution->success(); },
          "Whether the solver converged and what it found is feasible, optimal and true, computed anew.")
      .def_prop_ro(
          "converged", [](const S& s) { return s.solution->converged(); }, "The solver's own word.")
      .def_prop_ro(
          "status", [](const S& s) { return to_string(s.solution->nlp.status); }, "How the solver ended.")
      .def_prop_ro("verdict", verdict, "One sentence.")
      .def_prop_ro(
          "iterations", [](const S& s) { return s.solution->iterations(); }, "Of the solver, on all meshes.")
      .def_prop_ro(
          "intervals", [](const S& s) { return s.solution->meshes.back().intervals; }, "Of the last mesh.")
      .def_prop_ro(
          "meshes", meshes, nb::sig("def meshes(self) -> list[dict[str, Any]]"),
          "A dict a mesh, coarsest first: intervals, iterations, cost, status, defect, passed, cost_error, "
          "seconds.")
      .def_prop_ro("attempts", attempts, nb::sig("def attempts(self) -> list[dict[str, Any]]"),
                   "A dict a start of the solver on the last mesh: method, start, iterations, status, cost.")
      .def_prop_ro(
          "method", [](const S& s) { return to_string(s.solution->nlp.method); },
          "The method that found the motion: \"riccati\" or \"ipopt\".")
      .def_prop_ro("multipliers", multipliers, nb::sig("def multipliers(self) -> dict[str, Array]"),
                   "Of the last program: rows (constraints,), lower and upper (variables,), of the bounds; "
                   "in the program's order, "
                   "interval by interval.")
      .def_prop_ro("passings", passings, nb::sig("def passings(self) -> list[str]"),
                   "A sentence for each inequality and bound that is passed between points, the worst first.")
      .def_prop_ro(
          "true_cost", [](const S& s) { return s.solution->verification.true_cost; },
          "The costs integrated along the motion.")
      .def_prop_ro(
          "cost_change", [](const S& s) { return s.solution->cost_change; },
          "How far the cost is from that of a mesh twice as coarse wherever the controls changed, relative; "
          "NaN of one mesh.")
      .def_prop_ro(
          "passed", [](const S& s) { return s.solution->verification.passings.worst(); },
          "Most that an inequality or a bound is passed between points, relative to how far the motion moves "
          "there.")
      .def_prop_ro(
          "seconds", [](const S& s) { return s.solution->times().total; }, "Of the solver, on all meshes.")
      .def_prop_ro(
          "violation", [](const S& s) { return s.solution->verification.violation; },
          "Most that a constraint is broken by, computed anew, relative to nominal values.")
      .def_prop_ro(
          "true_defect", [](const S& s) { return s.solution->verification.worst_defect; },
          "Most that an interval differs from its re-simulation.");
}

}  // namespace

void bind_problem_solve(nb::module_& module, nb::class_<PythonProblem>& problem) {
  using S = ProblemSolution;
  nb::class_<S> type(module, "Solution",
                     "What a solve of a Problem found, computed anew; points come first in every array.");
  def_array(type, "t", "(points,) s.", [](const S& s) { return entries_of(s.solution->motion.t); });
  def_array(type, "x", "(points, states).", [](const S& s) { return rows_of(s.solution->motion.x); });
  def_array(type, "a", "(points, accelerations), of the inverse form.",
            [](const S& s) { return rows_of(s.solution->motion.a); });
  def_array(type, "u", "(points, controls).", [](const S& s) { return rows_of(s.solution->motion.u); });
  def_array(type, "q", "(points, nq).", [](const S& s) { return rows_of_state(s, 0, s.nq, "q"); });
  def_array(type, "v", "(points, nv).", [](const S& s) { return rows_of_state(s, s.nq, s.nv, "v"); });
  bind_motion(type);
  bind_found(type);
  bind_problem_sensitivities(module, type);
  static KeywordTexts texts;  // nanobind keeps the signature's address
  SolverOptions defaults;
  visit_options(defaults, texts);
  static const std::string signature =
      "def solve(self, intervals: int | None = None, *, scheme: str | None = None, hessian: str = 'exact', "
      "method: str = "
      "'automatic', refine: bool | None = None, compile: bool = True, progress: Progress = None" +
      texts.signature + ") -> Solution";
  static const std::string text =
      "Solves and verifies.\n\n"
      "intervals: of the mesh.  None: the first mesh is coarse; refined until the motion is true and the "
      "cost does not change.\n"
      "refine: whether to refine.  None: if intervals is None.\n"
      "scheme: \"euler\", \"trapezoid\", \"hermite-simpson\", \"radau-3\", ...  None: \"hermite-simpson\" on "
      "given intervals, otherwise\n"
      "    \"radau-3\", whose controls may jump at nodes.\n"
      "hessian: " +
      io::words_of(hessian_kinds()) + ".\nmethod: " + kNlpMethodsMeaning +
      ".  `solution.method` is the one that found the motion.\n"
      "compile: machine code at once, and compiled C as soon as it is there.  False: interprets.\n"
      "progress: is called with a sentence on how far the solve is.  Ctrl-C stops it.\n" +
      texts.lines +
      "\nRaises ArgumentError where the problem does not fit together, NumericalError where functions are "
      "not "
      "finite at\n"
      "the start.  A solve that fails is no error: see `success` and `verdict`.";
  problem.def("solve", solve_problem, nb::arg("intervals") = nb::none(), nb::kw_only(),
              nb::arg("scheme") = nb::none(), nb::arg("hessian") = "exact", nb::arg("method") = "automatic",
              nb::arg("refine") = nb::none(), nb::arg("compile") = true, nb::arg("progress") = nb::none(),
              nb::arg("more"), nb::sig(signature.c_str()), text.c_str());
}

}  // namespace dyntape::python
