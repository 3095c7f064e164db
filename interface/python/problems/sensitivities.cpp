// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of a solution of a Problem by its parameters and its start.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <dyntape/autodiff/error.h>

#include "../motions.h"
#include "../problems.h"
#include "../watch.h"
#include "sensitivities.h"

namespace dyntape::python {
namespace {

using Eigen::Index;

ProblemSensitivities sensitivities_of(const ProblemSolution& s) {
  if (s.solution->phases.size() != 1)
    throw ArgumentError("sensitivities: expected the solution of a problem without phases");
  const Trajectory& motion = s.solution->motion;
  MeshOptions mesh{.scheme = motion.scheme, .intervals = motion.intervals(), .nodes = motion.nodes()};
  mesh.evaluation.route = Route::kTiered;
  return watched(nb::none(), [&](const Watch& watch) -> ProblemSensitivities {
    mesh.evaluation.stop = watch.stop;
    const StagedNlp nlp = discretize(s.problem, mesh);
    MotionSensitivity sensitivity(s.problem, mesh);
    return {sensitivity.at(nlp.problem(), s.solution->nlp), motion, nlp.problem()};
  });
}

// The change of the motion with column k, as StagedNlp::trajectory() makes a motion of variables: controls at points that the scheme
// does not use are extrapolated.
Trajectory change_of(const ProblemSensitivities& s, const SensitivityTable& table, Index k) {
  const Eigen::Map<const Eigen::MatrixXd> z(table.x.col(k).data(), s.n_z, s.motion.points());
  Trajectory change{s.motion.t, z.topRows(s.n_x), z.middleRows(s.first_a, s.first_u - s.first_a),
                    z.bottomRows(s.n_z - s.first_u), s.motion.scheme};
  change.extend_to_unused();
  return change;
}

// (points, entries, columns) of the part of each change.
nb::object of_points(const ProblemSensitivities& s, const SensitivityTable& table,
                     Eigen::MatrixXd Trajectory::*part) {
  const Index columns = table.cost.size(), points = s.motion.points(), count = (s.motion.*part).rows();
  double* to = nullptr;
  nb::object array = new_array({points, count, columns}, to);
  for (Index k = 0; k < columns; ++k) {
    const Eigen::MatrixXd change = change_of(s, table, k).*part;
    for (Index point = 0; point < points; ++point)
      for (Index i = 0; i < count; ++i) to[(point * count + i) * columns + k] = change(i, point);
  }
  return array;
}

void bind_table(nb::class_<ProblemSensitivities>& type, SensitivityTable MotionSensitivities::*of,
                const std::string& by, const std::string& columns) {
  using S = ProblemSensitivities;
  def_array(type, kept("dx_d" + by), kept("(points, states, " + columns + ")."),
            [of](const S& s) { return of_points(s, s.found.*of, &Trajectory::x); });
  def_array(type, kept("du_d" + by), kept("(points, controls, " + columns + ")."),
            [of](const S& s) { return of_points(s, s.found.*of, &Trajectory::u); });
  def_array(type, kept("dcost_d" + by), kept("(" + columns + ",)."),
            [of](const S& s) { return entries_of((s.found.*of).cost); });
}

}  // namespace

void bind_problem_sensitivities(nb::module_& module, nb::class_<ProblemSolution>& solution) {
  using S = ProblemSensitivities;
  nb::class_<S> type(module, "Sensitivities",
                     "Derivatives of an optimal motion by its parameters and its start, to first order.");
  bind_table(type, &MotionSensitivities::parameters, "p", "parameters");
  bind_table(type, &MotionSensitivities::start, "start", "states");
  type.def_prop_ro(
          "parameters", [](const S& s) { return s.found.parameters.names; },
          "Names of the entries of the parameters, in the order of the last axis.")
      .def_prop_ro(
          "gain",
          [](const S& s) {
            const Eigen::MatrixXd by_rows = s.found.gain.transpose();
            return rows_of(by_rows);
          },
          nb::sig("def gain(self) -> Array"),
          "(controls, states): the derivative of the first control by the state at the start, with the "
          "controls "
          "at their limits held there.")
      .def_prop_ro(
          "good", [](const S& s) { return s.found.good(); },
          "Whether these are the derivatives: the solution is a strict minimum with independent active rows.")
      .def_prop_ro(
          "status", [](const S& s) { return to_string(s.found.status); }, "good, or the reason in a word.")
      .def_prop_ro(
          "why", [](const S& s) { return s.found.why; }, "The reason in a sentence; \"\": good.")
      .def("__repr__", [](const S& s) {
        return "<dyntape.Sensitivities: " + std::to_string(s.found.parameters.cost.size()) + " parameters, " +
               std::to_string(s.found.start.cost.size()) + " states, " + to_string(s.found.status) + ">";
      });
  def_no_pickle(type, "pass on its arrays");
  solution.def(
      "sensitivities", sensitivities_of,
      "Derivatives of this solution by the problem's parameters and by the state at t = 0: Sensitivities.\n\n"
      "Of a problem without phases, for a solve with a small tolerance.  If an entry of the start is free, "
      "its "
      "derivatives are zero.\n"
      "Raises ArgumentError for phases and for parameters of time with multiple shooting.\n\n"
      ">>> p = dyntape.Problem(\"block\", [\"p\", \"v\"], [\"u\"], 1.0, lambda s: [s.x[1], s.u[0]])\n"
      ">>> p.add_squares(\"effort\", lambda s: s.u)\n"
      ">>> p.start, p.goal = [0, 0], [1, 0]\n"
      ">>> by = p.solve(10, tolerance=1e-10).sensitivities()\n"
      ">>> round(float(by.gain[0, 0]), 6)       # du(0)/dp(0)\n"
      "-6.0");
}

}  // namespace dyntape::python
