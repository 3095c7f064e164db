// SPDX-License-Identifier: BSD-3-Clause
//
// A problem solved and verified, as Python has it.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/solve.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/player/player.h>

#include "motions.h"
#include "problems.h"
#include "watch.h"

namespace dyntape::python {
namespace {

struct ProblemSolution {
  std::shared_ptr<const PythonProblem> of;
  Problem problem;
  Solution solution;
  int nq = 0, nv = 0;
};

HessianKind hessian_from(const std::string& word) {
  if (word == "exact") return HessianKind::kExact;
  if (word == "gauss_newton") return HessianKind::kGaussNewton;
  if (word == "limited_memory") return HessianKind::kLimitedMemory;
  throw ArgumentError("solve: hessian: expected \"exact\", \"gauss_newton\" or \"limited_memory\", got \"" +
                      word + "\"");
}

NlpMethod method_from(const std::string& word) {
  if (word == "ipopt") return NlpMethod::kIpopt;
  if (word == "riccati") return NlpMethod::kRiccati;
  throw ArgumentError("solve: method: expected \"ipopt\" or \"riccati\", got \"" + word + "\"");
}

std::string words_of(const IterationRecord& now) {
  return "iteration " + std::to_string(now.iteration) + ", cost " + io::with_digits(now.objective, 6) +
         ", violation " + io::with_digits(now.primal_infeasibility, 2);
}

// A mesh to begin with, where Python gives none: coarse, but finer than terms at instants need.
constexpr int kFirstIntervals = 20;

std::shared_ptr<ProblemSolution> solve_problem(std::shared_ptr<PythonProblem> p, std::optional<int> intervals,
                                               const std::string& scheme, const std::string& hessian,
                                               const std::string& method, std::optional<bool> refine,
                                               double tolerance, int max_iterations, bool compile,
                                               nb::handle progress) {
  SolveOptions options;
  options.mesh.scheme = scheme_by_name(scheme);
  options.mesh.intervals = intervals.value_or(options.mesh.scheme.spans_all ? 1 : kFirstIntervals);
  options.mesh.hessian = hessian_from(hessian);
  options.mesh.evaluation.route = compile ? Route::kTiered : Route::kInterpreter;
  options.solver.method = method_from(method);
  options.solver.tolerance = tolerance;
  options.solver.max_iterations = max_iterations;
  const bool is_refined = refine.value_or(!intervals) && !options.mesh.scheme.spans_all;
  if (!is_refined) options.refinements = 0, options.is_graded = false;
  Problem problem = p->problem;
  Solution solution = watched(progress, [&](const Watch& watch) {
    options.solver.stop = options.mesh.evaluation.stop = watch.stop;
    if (watch.tell) options.solver.watch = [&](const IterationRecord& now) { watch.tell(words_of(now)); };
    return solve(problem, options);
  });
  const StageSizes sizes = p->sizes();
  return std::shared_ptr<ProblemSolution>(
      new ProblemSolution{std::make_shared<PythonProblem>(*p), std::move(problem), std::move(solution),
                          static_cast<int>(sizes.nq), static_cast<int>(sizes.nv)});
}

nb::object rows_of_state(const ProblemSolution& s, int first, int count, const char* what) {
  if (!s.of->is_robot) throw ArgumentError(std::string(what) + ": it is of a robot's problem; expected x");
  return rows_of(s.solution.motion.x.middleRows(first, count));
}

std::string page(const ProblemSolution& s) {
  if (!s.of->is_robot) throw ArgumentError("page: it is of a robot's problem; there is nothing to draw");
  const nb::gil_scoped_release unlocked;
  PlayerInput input;
  input.title = s.problem.name;
  input.model = s.of->scene.model;
  input.visuals = s.of->visuals();
  input.t = s.solution.motion.t;
  input.q = s.solution.motion.x.topRows(s.nq);
  return player_page(input);
}

std::string verdict(const ProblemSolution& s) { return s.solution.verdict(); }

nb::list meshes(const ProblemSolution& s) {
  nb::list rows;
  for (const MeshRound& m : s.solution.meshes) {
    nb::dict row;
    row["intervals"] = m.intervals, row["iterations"] = m.iterations, row["cost"] = m.cost;
    row["status"] = to_string(m.status), row["defect"] = m.relative_defect;
    row["passed"] = m.passed, row["cost_error"] = m.cost_error, row["seconds"] = m.seconds;
    rows.append(row);
  }
  return rows;
}

void bind_found(nb::class_<ProblemSolution>& type) {
  using S = ProblemSolution;
  def_page(type, page);
  type.def_prop_ro(
          "cost", [](const S& s) { return s.solution.cost(); }, "What was minimised.")
      .def_prop_ro(
          "success", [](const S& s) { return s.solution.success(); },
          "Whether the solver converged and what it found is feasible, optimal and true, computed anew.")
      .def_prop_ro(
          "converged", [](const S& s) { return s.solution.converged(); }, "The solver's own word.")
      .def_prop_ro(
          "status", [](const S& s) { return to_string(s.solution.nlp.status); }, "How the solver ended.")
      .def_prop_ro("verdict", verdict, "One sentence.")
      .def_prop_ro(
          "iterations", [](const S& s) { return s.solution.iterations(); }, "Of the solver, on all meshes.")
      .def_prop_ro(
          "intervals", [](const S& s) { return s.solution.meshes.back().intervals; }, "Of the last mesh.")
      .def_prop_ro(
          "meshes", meshes, nb::sig("def meshes(self) -> list[dict]"),
          "A dict a mesh, coarsest first: intervals, iterations, cost, status, defect, passed, cost_error, "
          "seconds.")
      .def_prop_ro(
          "true_cost", [](const S& s) { return s.solution.verification.true_cost; },
          "The costs integrated along the motion.")
      .def_prop_ro(
          "cost_change", [](const S& s) { return s.solution.cost_change; },
          "How far the costs of the last two meshes differ, relative; NaN of one mesh.")
      .def_prop_ro(
          "passed", [](const S& s) { return s.solution.verification.passings.worst(); },
          "Most that an inequality or a bound is passed between points, relative to how far the motion moves "
          "there.")
      .def_prop_ro(
          "seconds", [](const S& s) { return s.solution.nlp.times.total; }, "Of the solver.")
      .def_prop_ro(
          "violation", [](const S& s) { return s.solution.verification.violation; },
          "Most that a constraint is broken by, computed anew, relative to nominal values.")
      .def_prop_ro(
          "true_defect", [](const S& s) { return s.solution.verification.worst_defect; },
          "Most that an interval differs from its re-simulation.")
      .def("__repr__", [](const S& s) {
        return "<dyntape.Solution of \"" + s.problem.name + "\": " + verdict(s) + ", cost " +
               io::with_digits(s.solution.cost(), 6) + ", " + std::to_string(s.solution.motion.points()) +
               " points, " + std::to_string(s.solution.iterations()) + " iterations>";
      });
}

}  // namespace

void bind_problem_solve(nb::module_& module, nb::class_<PythonProblem>& problem) {
  using S = ProblemSolution;
  nb::class_<S> type(module, "Solution",
                     "What a solve of a Problem found, computed anew; points come first in every array.");
  def_array(type, "t", "(points,) s.", [](const S& s) { return entries_of(s.solution.motion.t); });
  def_array(type, "x", "(points, states).", [](const S& s) { return rows_of(s.solution.motion.x); });
  def_array(type, "a", "(points, accelerations), of the inverse form.",
            [](const S& s) { return rows_of(s.solution.motion.a); });
  def_array(type, "u", "(points, controls).", [](const S& s) { return rows_of(s.solution.motion.u); });
  def_array(type, "q", "(points, nq).", [](const S& s) { return rows_of_state(s, 0, s.nq, "q"); });
  def_array(type, "v", "(points, nv).", [](const S& s) { return rows_of_state(s, s.nq, s.nv, "v"); });
  bind_found(type);
  problem.def(
      "solve", solve_problem, nb::arg("intervals") = nb::none(), nb::kw_only(),
      nb::arg("scheme") = "hermite-simpson", nb::arg("hessian") = "exact", nb::arg("method") = "ipopt",
      nb::arg("refine") = nb::none(), nb::arg("tolerance") = 1e-8, nb::arg("max_iterations") = 3000,
      nb::arg("compile") = true, nb::arg("progress") = nb::none(),
      nb::sig(
          "def solve(self, intervals: int | None = None, *, scheme: str = 'hermite-simpson', hessian: str = "
          "'exact', method: str = 'ipopt', refine: bool | None = None, tolerance: float = 1e-08, "
          "max_iterations: int = 3000, compile: bool = True, "
          "progress: Progress = None) -> Solution"),
      "Solves and verifies.\n\n"
      "intervals: of the mesh; None: begins with a coarse mesh and refines it until the motion is true and "
      "the cost "
      "does not\nchange.  refine: whether to refine; None: if intervals is None.  scheme: euler, trapezoid, "
      "hermite-simpson, ...  hessian: \"exact\", "
      "\"gauss_newton\" or\n"
      "\"limited_memory\".  method: \"ipopt\" or \"riccati\".  compile: machine code at once, compiled C "
      "when "
      "that is there; False interprets.\n"
      "progress: is told in words how far it is.  Ctrl-C stops it.\n\n"
      "Raises ArgumentError where the problem does not fit together, NumericalError where functions are not "
      "finite at\n"
      "the start.  A solve that fails is no error: see `success` and `verdict`.");
}

}  // namespace dyntape::python
