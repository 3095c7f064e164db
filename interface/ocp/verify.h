// SPDX-License-Identifier: BSD-3-Clause
//
// What a motion is worth, found without any recorded, derived or generated code: the problem's functions are
// run as they are, in doubles.
//
//   const Verification v = verify(problem, motion);
//   v.violation            largest violation of defects, path and end constraints, bounds and boundary values
//   v.worst_defect         true defect: what the scheme cannot know about itself
//   v.miss                 where the controls alone lead
//
// True defect of an interval: x' = ode(t, x, u(t)) is integrated from the motion's state at its first node by
// the Runge-Kutta-Fehlberg method 7(8) (E. Fehlberg, NASA TR R-287, 1968; tolerance 1e-12), the control
// interpolated as the scheme says, and compared with the motion's state at the next node (max norm).  The
// miss is the same over the whole time, from the start, compared with the last state.  For a dynamics that
// amplifies errors the miss is large although every defect is small.
#pragma once

#include <dyntape/interface/ocp/problem.h>
#include <dyntape/interface/ocp/trajectory.h>

namespace dyntape {

struct Verification {
  double violation = 0;
  std::string worst_row = {};   // what is violated most
  double cost = 0;              // the scheme's quadrature of the costs
  Eigen::VectorXd true_defect;  // (intervals); NaN where the simulation breaks down
  double worst_defect = 0;
  double miss = 0;
};

Verification verify(const Problem& problem, const Trajectory& motion);

// The state at the end of x' = ode(t, x, u(t)) from x at time `from`; NaN where it breaks down.
Eigen::VectorXd simulate(const Problem& problem, Eigen::VectorXd x, double from, double to,
                         const std::function<Eigen::VectorXd(double t)>& control, double tolerance = 1e-12);

}  // namespace dyntape
