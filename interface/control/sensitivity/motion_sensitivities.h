// SPDX-License-Identifier: BSD-3-Clause
//
// Derivatives of an optimal motion with respect to the parameters (parameters.h) and the start of its problem.
//
//   const MeshOptions mesh{.intervals = 40};
//   StagedNlp nlp = discretize(p, mesh);
//   const NlpSolution s = solve_nlp(nlp, nlp.start(), {.tolerance = 1e-10});
//   MotionSensitivity sensitivity(p, mesh);                      // records and compiles once
//   const MotionSensitivities derivatives = sensitivity.at(nlp.problem(), s);
//   if (derivatives.good()) derivatives.parameters.cost[0];                // dJ/dp of parameters.names[0]
//   u0 += derivatives.gain * (x0 - planned);                          // feedback on the first control
//   Problem next = nlp.problem();
//   next.parameters.set("load", 2.1);
//   NlpSolution near = sensitivity.predict(next);                // first-order prediction: a start for the next solve
//
// Shapes, with the program's variables (n) and rows (m): x (n x k), lambda (m x k), cost (k).  If a parameter is a
// function of time, its derivative is with respect to a constant added to it.  predict() uses its values at all
// points.  Free entries of the start have zero derivatives.
//
// Method.  Parameters become states with rate zero, fixed at all points.  Their columns of Jacobian and Hessian are
// the mixed derivatives, for all schemes, forms, free durations and terms.  A parameter is thus one more fixed
// variable (solution_sensitivities.h, which lists the statuses).  Cost: one factorisation, and one solve per
// parameter.  The unused second derivatives between parameters are evaluated too, which matters for dozens of
// parameters.
//
// The mesh must be the solve's.  The kind of Hessian is free, since second derivatives are exact here.  If the
// solution is from Gauss-Newton or from one real-time iteration, the derivatives are still those of the problem, if
// the point is a solution (status).
//
// Errors.  ArgumentError for:
//
// - problems that StagedNlp refuses, and parameters of time with multiple shooting
// - a solution of another mesh, or predict() before at()
// - predict() with values that free a fixed entry, fix a free one (e.g. a new goal), or move an inactive limit
// beyond the prediction, since predict() keeps the active limits of the solution
#pragma once

#include <optional>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/sensitivity/solution_sensitivities.h>

namespace dyntape {

struct SensitivityTable {
  std::vector<std::string> names;  // (k)
  Eigen::MatrixXd x, lambda;       // (n x k), (m x k)
  Eigen::VectorXd cost;            // (k)
  // The range of each change, alone and to first order, in which the active set is constant: from <= 0 <= to.
  Eigen::VectorXd from, to;
};

struct MotionSensitivities {
  SensitivityStatus status = SensitivityStatus::kNotFinite;
  std::string why;                     // the reason if not good, or ""
  SensitivityTable parameters, start;  // by entries of the parameters; by states at t = 0
  Eigen::MatrixXd gain;                // (n_u x n_x) d u(0) / d x(0)

  bool good() const { return status == SensitivityStatus::kGood; }
};

class MotionSensitivity {
 public:
  // `mesh`: the mesh of the StagedNlp that is solved; its kind of Hessian is ignored.
  MotionSensitivity(const Problem& problem, const MeshOptions& mesh);
  ~MotionSensitivity();
  MotionSensitivity(MotionSensitivity&&) noexcept;
  MotionSensitivity& operator=(MotionSensitivity&&) noexcept;

  // `now`: the problem with the values of the solve, as in StagedNlp::problem().
  MotionSensitivities at(const Problem& now, const NlpSolution& solution);

  // Predicts x, lambda, bound multipliers and cost for other values, to first order from the last at(): parameters,
  // fixed start, goal and bounds.  The status is that of the last solution.  If it has no derivatives, all values
  // are NaN.
  NlpSolution predict(const Problem& next);

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
