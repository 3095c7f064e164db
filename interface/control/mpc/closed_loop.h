// SPDX-License-Identifier: BSD-3-Clause
//
// Simulates a receding-horizon controller and its plant, with disturbances and with the computing time of the
// controller.
//
//   const ClosedLoop loop = close_loop(problem, {.seconds = 3, .period = 0.02, .disturbances = {{1.0, dx}}});
//   plot(loop.motion.t, loop.motion.x);        loop.latency(0.99);        // s
//
// In each period, the state is measured and a plan is computed.  The plan is applied `delay` later; until then the
// previous plan is.  A plan starts at the state that is predicted for the time of its application.
//
// - Default plant: the problem's own dynamics, integrated to 1e-10 (verify.h).  It is also the prediction.
// - Simulated plant (ClosedLoopOptions::plant): the prediction is the previous plan's state at that time, plus the
// current deviation from this plan.
//
// A disturbance is added to the plant's state.  The controller sees it at the next measurement.
//
// If a plan is not usable, the previous plan continues.
//
// If `feedback` is above 0 s, the plant corrects the control with the plan's gains (receding_horizon.h) once per
// `feedback` and holds the correction in between.  So the reaction to a disturbance does not wait for the next plan.
//
// Errors:
//
// - errors of RecedingHorizon
// - ArgumentError: times that are not positive, a delay of a period or more, a disturbance of another size than the
// state
//
// If the first plan is not usable, or the plant cannot be simulated, the loop ends and `trouble` has the reason.
#pragma once

#include <functional>
#include <stop_token>

#include <dyntape/interface/control/mpc/receding_horizon.h>

namespace dyntape {

struct Disturbance {
  double at;               // s
  Eigen::VectorXd change;  // (n_x) of the state
  // If set, used instead of `change`: returns the change for the current state.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x)> of_state = {};
};

// A plant other than the problem's own dynamics.  Advances x (n_x) from one time to another, and may call `control`
// (n_u) at any time in between.  Returns "", or the reason why the simulation failed.
using SimulatedPlant = std::function<std::string(Eigen::VectorXd& x, double from, double to,
                                                 const std::function<Eigen::VectorXd(double t)>& control)>;

struct ClosedLoopOptions {
  double seconds = 3, period = 0.02, delay = 0;  // s
  double feedback = 0;  // s between corrections with the plan's gains; 0: no feedback
  MpcOptions mpc = {};
  std::vector<Disturbance> disturbances = {};
  SimulatedPlant plant = {};  // empty: the problem's own dynamics
  // Called at every step.  Returns the reason to end the loop, e.g. that the robot fell; "" to continue.
  std::function<std::string(double t, const Eigen::VectorXd& x)> is_over = {};
  std::stop_token stop = {};
  std::function<void(double t)> watch = {};  // called at the beginning of each step
};

struct ClosedLoop {
  struct Step {
    double t, seconds, gain_seconds, cost, violation;
    int iterations;
    SolveStatus status;
    bool usable;
  };
  Trajectory motion;  // the plant at the times of steps, and the control at these times
  std::vector<Step> steps;
  std::string trouble;
  BuildReport build;

  double latency(double share) const;  // quantile (s) of the computing times, without the first step
  int missed(double deadline) const;   // number of steps above the deadline (s), without the first step
  int unusable() const;
};

ClosedLoop close_loop(const Problem& problem, const ClosedLoopOptions& options);

}  // namespace dyntape
