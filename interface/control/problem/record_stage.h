// SPDX-License-Identifier: BSD-3-Clause
//
// The functions of one point of a problem, each recorded once.
//
//   RecordedStage s = record_stage(problem);
//   s.node      (z; t, p) -> f (n_x) | path rows | L (1)    z = (x, a, u), p the problem's parameters (parameters.h)
//   s.instants  of each instant at which terms stand, the end last:
//     terms     (z; t, p) -> rows | M (1)                   no outputs where no term stands there
//   squares     of the node and of each instant, (z; t, p) -> r: residuals whose Jacobian gives Gauss-Newton's curvature 2 J^T J
//
// Path rows are the residual of the inverse form, then the path terms in the order of the list.  L is the sum
// of the running costs (r.r of a least-squares term), M that of the costs of an instant.  What the terms share is
// computed once, because they are recorded on one tape.
//
// Slopes by parameters: all_as_variables(s.node) (function.h) is the same function of the variables (z, t, p), whose
// Jacobian has df/dp in the columns from n_z + 1 on.
//
// Errors: ArgumentError, naming the term, where a cost is no scalar or bounds have the wrong size or are empty.
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/control/problem/multiple_shooting.h>

namespace dyntape {

struct ConstraintRow {
  std::string name;  // "obstacle[1]"
  double lower, upper;
};

struct RecordedInstant {
  double share;  // of the duration
  Function terms, squares;
  std::vector<ConstraintRow> rows;
};

struct RecordedStage {
  Function node, squares;
  std::vector<RecordedInstant> instants;               // in the order of time; the last is the end
  std::vector<ConstraintRow> path_rows, instant_rows;  // instant_rows: of all instants, one after another
};

RecordedStage record_stage(const Problem& problem);

// One step of length h with the controls held, for methods that go from step to step:
//   step  (x, u; t, h, p, p_m, p_e) -> x' (n_x) | int L dt | r      with the parameters at its beginning, middle and end
//   end   (x; t, p) -> M, with controls of zero
// r, where it is asked for: residuals whose Jacobian gives Gauss-Newton's curvature 2 J^T J; their squares add up to int L dt
// where every cost is one of squares.
// By the schemes of multiple_shooting.h.
// ArgumentError, naming it, for what such methods do not know: constraints but the limits of controls, a goal, the inverse form,
// a free duration, terms between start and end; and, where r is asked for, for a running cost of which Gauss-Newton knows
// nothing.
struct RecordedShooting {
  Function step, end;
};
RecordedShooting record_shooting(const Problem& problem, ShootingScheme scheme = ShootingScheme::kRungeKutta4,
                                 bool with_residuals = false);
void check_shooting(const Problem& problem);  // that ArgumentError

// What becomes of the state at the end of a phase (phases.h): (x; t, p) -> next (n_next).
Function record_link(const Problem& before, const StageFunction& change, const std::string& name);

// Names of the entries of z: states, accelerations, controls.
std::vector<std::string> stage_names(const Problem& problem);

// What the functions take for parameters at time t: (t, p).
Eigen::VectorXd parameters_of(const Problem& problem, double t);

}  // namespace dyntape
