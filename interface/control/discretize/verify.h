// SPDX-License-Identifier: BSD-3-Clause
//
// Verifies a motion independently of the solver: evaluates constraints, and integrates the controls.  The problem's
// functions run in plain double, without recorded, differentiated or generated code.
//
//   const Verification v = verify(problem, motion, nlp.scaling(start));
//   v.violation            largest violation of defects, path and end constraints, bounds and boundary values, relative
//                          to the program's nominal values (nlp.h); for states at least 1e-4 of their group's (below)
//   v.worst_defect         true defect, which the scheme itself cannot measure
//   v.worst_relative       the defect relative to the range of each state, with worst_interval and worst_state
//   v.miss                 open-loop error: end of a simulation of the controls, minus the motion's last state
//   v.cost_error           |true cost - quadrature of the scheme|, relative to the sum of all costs' magnitudes
//   v.passings             inequalities and bounds that are violated between points (passings.h)
//
// True defect of an interval.  x' = ode(t, x, u(t)) is integrated from the motion's state at the first node by a
// method of order 8 (dormand_prince.h; tolerance 1e-12 relative to 1 + |x| of each state), with the scheme's
// interpolation of the control.  The defect is the difference from the motion's state at the next node (max norm).
// The open-loop error is the same over the whole time.  If the dynamics amplify errors, the open-loop error is large
// although all defects are small.  An interval has at least 16 steps, so that events longer than about a hundredth
// of it are seen; shorter ones may be missed.
//
// Relative defects.  Each state is divided by the largest of:
//
// - its range: the largest minus the smallest value in the motion
// - a hundredth of its magnitude: the program's nominal value, at most a thousand times the largest number in the
// motion
// - 1e-4 of the largest range of its group: states whose names are equal up to a dot, such as a robot's q.* and v.*;
// names without a dot are groups of one state
//
// The second keeps a fixed joint's error of a millionth of a radian small.  The third does the same for joints that
// move by rounding only, or by micrometres beside centimetres in nearly symmetric robots.  If 1e-3 is allowed, the
// third accepts errors up to 1e-7 of the largest movement.
//
// A stop request ends the simulations: values not simulated are NaN, and `trouble` says so.  A violation, defect or
// open-loop error that cannot be computed is NaN, and `trouble` says where the simulation ended.
#pragma once

#include <stop_token>

#include <dyntape/interface/control/discretize/passings.h>
#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/nlp/nlp.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct Verification {
  double violation = 0;
  std::string worst_row = {};  // the constraint with the largest violation
  double cost = 0;             // the scheme's quadrature of the costs
  // The running costs integrated along the simulated intervals, with the same adaptive steps, plus the costs at
  // instants.
  double true_cost = 0;
  double cost_size = 0;              // sum of the magnitudes of all costs
  double cost_error = 0;             // |true_cost - cost| / cost_size
  Eigen::VectorXd cost_errors = {};  // (intervals) contribution of each
  Passings passings = {};
  Eigen::VectorXd integration_error;  // (intervals); NaN if the simulation failed
  double worst_defect = 0;
  Eigen::VectorXd relative_defect;  // (intervals) relative to the ranges of the states
  double worst_relative = 0;
  int worst_interval = 0;         // the interval with the largest relative defect
  std::string worst_state = {};   // its state with the largest defect; "": none
  double worst_state_defect = 0;  // the defect of this state, in its own unit
  double miss = 0;                // open-loop error
  std::string miss_state = {};    // the state with the open-loop error; the error is in its unit
  int miss_index = -1;            // index of this state
  std::string trouble = {};       // "interval 3: the rate of "v" is nan at t = 0.75 s"; empty: none
};

// Empty nominal values mean ones.  ArgumentError if they belong to another program.
Verification verify(const Problem& problem, const Trajectory& motion, const NlpScaling& scaling = {},
                    const std::stop_token& stop = {});

// (n_x) The reference of each state's relative defect, see above.  Empty nominal values mean ones.
Eigen::VectorXd extents_of(const Problem& problem, const Trajectory& motion, const NlpScaling& scaling = {});

// Integrates x' = ode(t, x, u(t)) from x at time `from` to `to`; if to <= from, returns x.
struct Simulation {
  Eigen::VectorXd x;    // all NaN if the simulation failed
  std::string trouble;  // the reason: "the rate of "v" is nan at t = 0.75 s"
  double cost = 0;      // the integral of a running cost
};
// A running cost, integrated with the states to an error of about `tolerance` per step, in the unit of the cost.
struct RunningCost {
  std::function<double(double t, const Eigen::VectorXd& x, const Eigen::VectorXd& u)> rate;
  double tolerance;
};
Simulation simulate(const Problem& problem, Eigen::VectorXd x, double from, double to,
                    const std::function<Eigen::VectorXd(double t)>& control, double tolerance = 1e-12,
                    const RunningCost* cost = nullptr);

}  // namespace dyntape
