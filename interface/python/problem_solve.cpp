// SPDX-License-Identifier: BSD-3-Clause
//
// A problem solved and verified, as Python has it.
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <dyntape/autodiff/error.h>
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

std::shared_ptr<ProblemSolution> solve(std::shared_ptr<PythonProblem> p, int intervals,
                                       const std::string& scheme, const std::string& hessian,
                                       const std::string& method, double tolerance, int max_iterations,
                                       bool compile, nb::handle progress) {
  OptimiseOptions options;
  options.mesh.scheme = scheme_by_name(scheme);
  options.mesh.intervals = intervals;
  options.mesh.hessian = hessian_from(hessian);
  options.mesh.evaluation.route = compile ? Route::kTiered : Route::kInterpreter;
  options.solver.method = method_from(method);
  options.solver.tolerance = tolerance;
  options.solver.max_iterations = max_iterations;
  Problem problem = p->problem;
  Solution solution = watched(progress, [&](const Watch& watch) {
    options.solver.stop = options.mesh.evaluation.stop = watch.stop;
    if (watch.tell) options.solver.watch = [&](const IterationRecord& now) { watch.tell(words_of(now)); };
    return optimise(problem, options);
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

std::string verdict(const ProblemSolution& s) {
  const Solution& found = s.solution;
  if (!found.converged()) return describe(found.nlp.status);
  if (found.success()) return "solved, and verified";
  const Verification& v = found.verification;
  if (!is_feasible(v, found.demands))
    return "solved, but " + v.worst_row + " is violated by " + io::with_digits(v.violation, 2);
  if (!is_accurate(v, found.demands))
    return v.trouble.empty() ? "solved, but an interval differs from its re-simulation by " +
                                   io::with_digits(v.worst_relative, 2) + " of the motion; use more intervals"
                             : "solved, but " + v.trouble;
  return "solved, but its multipliers do not show it to be an optimum";
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
          "iterations", [](const S& s) { return s.solution.nlp.iterations(); }, "Of the solver.")
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
               " points, " + std::to_string(s.solution.nlp.iterations()) + " iterations>";
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
      "solve", solve, nb::arg("intervals") = 40, nb::kw_only(), nb::arg("scheme") = "hermite-simpson",
      nb::arg("hessian") = "exact", nb::arg("method") = "ipopt", nb::arg("tolerance") = 1e-8,
      nb::arg("max_iterations") = 3000, nb::arg("compile") = true, nb::arg("progress") = nb::none(),
      nb::sig(
          "def solve(self, intervals: int = 40, *, scheme: str = 'hermite-simpson', hessian: str = 'exact', "
          "method: str = 'ipopt', tolerance: float = 1e-08, max_iterations: int = 3000, compile: bool = "
          "True, "
          "progress: Progress = None) -> Solution"),
      "Solves and verifies.\n\n"
      "intervals: of the mesh.  scheme: euler, trapezoid, hermite-simpson, ...  hessian: \"exact\", "
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
