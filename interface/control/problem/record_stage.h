// SPDX-License-Identifier: BSD-3-Clause
//
// Records the functions of one point of a problem, once for all points.
//
//   RecordedStage s = record_stage(problem);
//   s.node      (z; t, p) -> f (n_x) | path rows | L (1)    z = (x, a, u), p the problem's parameters (parameters.h)
//   s.instants  for each instant with terms, the end last:
//     terms     (z; t, p) -> rows | M (1)                   no outputs without terms
//   squares     of the node and of each instant, (z; t, p) -> r: residuals whose Jacobian gives Gauss-Newton's
//               curvature 2 J^T J
//
// Path rows are the residual of the inverse form, then the path terms in the order of the list.  L is the sum of the
// running costs (r.r for squares), M of the costs of an instant.  Terms share common operations, since they are on
// one tape.
//
// Derivatives with respect to parameters: all_as_variables(s.node) (function.h) is the same function of (z, t, p);
// its Jacobian has df/dp in the columns from n_z + 1 on.
//
// Errors.  ArgumentError, naming the term: a cost that is not a scalar, bounds of wrong size or empty.
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
  double share;  // fraction of the duration
  Function terms, squares;
  std::vector<ConstraintRow> rows;
};

struct RecordedStage {
  Function node, squares;
  std::vector<RecordedInstant> instants;               // in order of time; the last is the end
  std::vector<ConstraintRow> path_rows, instant_rows;  // instant_rows: of all instants in sequence
};

RecordedStage record_stage(const Problem& problem);

// One step of length h with constant controls, for methods that integrate (the schemes of multiple_shooting.h):
//   step  (x, u; t, h, p, p_m, p_e) -> x' (n_x) | int L dt | r      with the parameters at its beginning, middle and
//         end
//   end   (x; t, p) -> M, with zero controls
// r, if requested: residuals whose Jacobian J gives the Gauss-Newton curvature 2 J^T J.  Their squares add up to int
// L dt if all costs are squares.
//
// Errors.  ArgumentError, with the reason: constraints other than limits of controls, a goal, the inverse form, a
// free duration, terms between start and end; if r is requested, also a running cost without residuals for
// Gauss-Newton.
struct RecordedShooting {
  Function step, end;
};
RecordedShooting record_shooting(const Problem& problem, ShootingScheme scheme = ShootingScheme::kRungeKutta4,
                                 bool with_residuals = false);
void check_shooting(const Problem& problem);  // throws this ArgumentError

// The link from the end of a phase (phases.h): (x; t, p) -> next (n_next).
Function record_link(const Problem& before, const StageFunction& change, const std::string& name);

// Names of the entries of z: states, accelerations, controls.
std::vector<std::string> stage_names(const Problem& problem);

// The parameter vector (t, p) of these functions at time t.
Eigen::VectorXd parameters_of(const Problem& problem, double t);

}  // namespace dyntape
