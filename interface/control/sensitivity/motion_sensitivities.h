// SPDX-License-Identifier: BSD-3-Clause
//
// How an optimal motion changes with the parameters of its problem (parameters.h) and with its start.
//
//   const MeshOptions mesh{.intervals = 40};
//   StagedNlp nlp = discretize(p, mesh);
//   const NlpSolution s = solve_nlp(nlp, nlp.start(), {.tolerance = 1e-10});
//   MotionSensitivity sensitivity(p, mesh);                      // recorded and compiled: once
//   const MotionSensitivities derivatives = sensitivity.at(nlp.problem(), s);
//   if (derivatives.good()) derivatives.parameters.cost[0];                // dJ/dp of parameters.names[0]
//   u0 += derivatives.gain * (x0 - planned);                          // feedback on the first control
//   Problem next = nlp.problem();
//   next.parameters.set("load", 2.1);
//   NlpSolution near = sensitivity.predict(next);                // of the first order: a start for the next solve
//
// Shapes, in the order of the program's variables (n) and rows (m): x (n x k), lambda (m x k), cost (k).  Slopes of a
// parameter that is a function of time are by a number added to it at all times; predict() takes what it is at every
// point.  A start entry that is free has no derivatives: zero.
//
// Method.  Parameters become states with a rate of zero, held at all points: their columns of Jacobian and Hessian
// are the mixed derivatives, whatever scheme, form, free duration or terms there are, and a parameter is one more
// variable that is held (solution_sensitivities.h, which says what is flagged).  It takes one factorisation, and a solve
// each.  Of dozens of parameters the second derivatives among themselves, which nobody needs, are evaluated, too.
//
// The mesh is that of the solve, its kind of Hessian any: second derivatives are exact here.  At a solution by
// Gauss-Newton, or one step of the real-time iteration, derivatives are those of the problem itself, if it is a solution
// (status).
//
// Errors: ArgumentError for what StagedNlp refuses, for parameters of time where the scheme is multiple shooting, for a solution of another mesh; for predict() before at(), or
// where it is asked for values that leave open what was held, hold what was open (a goal that is new, say), or move a limit
// that did not hold to where the prediction would be beyond it: which of the limits hold is what it takes from the solution.
#pragma once

#include <optional>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/sensitivity/solution_sensitivities.h>

namespace dyntape {

struct SensitivityTable {
  std::vector<std::string> names;  // (k)
  Eigen::MatrixXd x, lambda;       // (n x k), (m x k)
  Eigen::VectorXd cost;            // (k)
  // How far each may be changed, alone and to first order, before a bound is reached or left: from <= 0 <= to.
  Eigen::VectorXd from, to;
};

struct MotionSensitivities {
  SensitivityStatus status = SensitivityStatus::kNotFinite;
  std::string why;                     // "": good
  SensitivityTable parameters, start;  // by entries of the parameters; by states at t = 0
  Eigen::MatrixXd gain;                // (n_u x n_x) d u(0) / d x(0)

  bool good() const { return status == SensitivityStatus::kGood; }
};

class MotionSensitivity {
 public:
  // `mesh` as of the StagedNlp that is solved; its kind of Hessian is not read.
  MotionSensitivity(const Problem& problem, const MeshOptions& mesh);
  ~MotionSensitivity();
  MotionSensitivity(MotionSensitivity&&) noexcept;
  MotionSensitivity& operator=(MotionSensitivity&&) noexcept;

  // `now`: the values that were solved with, as of StagedNlp::problem().
  MotionSensitivities at(const Problem& now, const NlpSolution& solution);

  // What x, lambda, bound multipliers and cost will be with other values, to first order from the last at(): parameters, start,
  // goal and bounds that are held.  Its status is that of the solution that it was found from; all NaN where that has
  // no derivatives.
  NlpSolution predict(const Problem& next);

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
