// SPDX-License-Identifier: BSD-3-Clause
//
// What a motion is worth, found without any recorded, derived or generated code: the problem's functions are
// run as they are, in doubles.
//
//   const Verification v = verify(problem, motion, nlp.scaling(start));
//   v.violation            largest violation of defects, path and end constraints, bounds and boundary values,
//                          relative to the program's nominal values (nlp.h), of a state to 1e-4 of its kind's at least (below)
//   v.worst_defect         true defect: what the scheme cannot know about itself
//   v.worst_relative       the same, measured by how far the motion moves each state, and worst_interval, worst_state
//   v.miss                 open-loop error: how far the controls alone lead from the motion's last state
//   v.cost_error           true cost of the motion against the scheme's quadrature, of the sum of all costs' magnitudes
//   v.passings             inequalities and bounds that hold at points and are passed between them (passings.h)
//
// True defect of an interval: x' = ode(t, x, u(t)) is integrated from the motion's state at its first node by
// a method of order 8 (dormand_prince.h; tolerance 1e-12), the control interpolated as the scheme says, and
// compared with the motion's state at the next node (max norm).  The miss is the same over the whole time, from
// the start, compared with the last state.  For a dynamics that amplifies errors the miss is large although
// every defect is small.  An interval is simulated in 16 steps or more, so that an event is seen that lasts longer
// than about a hundredth of it; a shorter one may be stepped over.  The tolerance is relative to 1 + |x| of each state.
//
// Relative defects have no unit: each state is divided by its extent, the largest less the smallest value that the
// motion gives it, or by a hundredth of its magnitude, if that is more: of a joint that is held still a millionth of a radian is
// no large part of anything.  The magnitude is the nominal value in the program, but no more than a
// thousand times the largest number in the motion.  Or by 1e-4 of the largest extent of its kind, if that is more still:
// of a kind are states whose names begin alike up to a dot, as a robot's q.* and v.*; names without a dot are each a kind.  So
// a joint that only rounding moves, or that moves by micrometres beside others that move by centimetres because a robot is
// nearly symmetric, is measured as they are.  Where 1e-3 is allowed an error of 1e-7 of the largest movement passes, and no
// larger one.
//
// A request to stop ends the simulations: what was not simulated is NaN, and `trouble` says so.
//
// Whatever is not a number shows: a violation, a defect or a miss that cannot be computed is NaN, and `trouble`
// says where the simulation of an interval ended.
#pragma once

#include <stop_token>

#include <dyntape/interface/control/discretize/passings.h>
#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/nlp/nlp.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct Verification {
  double violation = 0;
  std::string worst_row = {};  // what is violated most
  double cost = 0;             // the scheme's quadrature of the costs
  // The running costs integrated along the simulated intervals, by the same adaptive steps, and the costs of instants.
  double true_cost = 0;
  double cost_size = 0;              // sum of the magnitudes of all costs
  double cost_error = 0;             // |true_cost - cost| over that
  Eigen::VectorXd cost_errors = {};  // (intervals) part of each
  Passings passings = {};
  Eigen::VectorXd integration_error;  // (intervals); NaN where the simulation breaks down
  double worst_defect = 0;
  Eigen::VectorXd relative_defect;  // (intervals) the same of the motion's extents
  double worst_relative = 0;
  int worst_interval = 0;         // which is off by most, relatively
  std::string worst_state = {};   // and the state that is; empty: none
  double worst_state_defect = 0;  // by how much, in its own unit
  double miss = 0;                // open-loop error: where the controls alone lead, from the start
  std::string miss_state = {};    // the state that it is of, in whose unit it is
  int miss_index = -1;            // and its place
  std::string trouble = {};       // "interval 3: the rate of "v" is nan at t = 0.75 s"; empty: none
};

// Empty nominal values are ones.  ArgumentError where they are of another program.
Verification verify(const Problem& problem, const Trajectory& motion, const NlpScaling& scaling = {},
                    const std::stop_token& stop = {});

// (n_x) How far the motion moves each state, or what it is measured by where it moves little (above).  Without nominal
// values they count as ones.
Eigen::VectorXd extents_of(const Problem& problem, const Trajectory& motion, const NlpScaling& scaling = {});

// The state at the end of x' = ode(t, x, u(t)) from x at time `from`, to <= from being no time at all.
struct Simulation {
  Eigen::VectorXd x;    // NaN, all of it, where the simulation breaks down
  std::string trouble;  // why it did: "the rate of "v" is nan at t = 0.75 s"
  double cost = 0;      // the integral of a running cost
};
// A running cost, integrated with the states to an error of about `tolerance` a step, in the unit of the cost.
struct RunningCost {
  std::function<double(double t, const Eigen::VectorXd& x, const Eigen::VectorXd& u)> rate;
  double tolerance;
};
Simulation simulate(const Problem& problem, Eigen::VectorXd x, double from, double to,
                    const std::function<Eigen::VectorXd(double t)>& control, double tolerance = 1e-12,
                    const RunningCost* cost = nullptr);

}  // namespace dyntape
