// SPDX-License-Identifier: BSD-3-Clause
//
// A receding horizon and the plant that it steers, simulated: with disturbances, and with the time that a real controller takes.
//
//   const ClosedLoop loop = close_loop(problem, {.seconds = 3, .period = 0.02, .disturbances = {{1.0, dx}}});
//   plot(loop.motion.t, loop.motion.x);        loop.latency(0.99);        // s
//
// Each period the state is measured and planned from; what is planned acts `delay` later, until then the plan before it.  Plans
// begin where the model will be by then.  With a simulated plant, which only it knows, that is where the plan before is then, and as
// far off as now.  Else the plant is the problem's own dynamics, integrated to 1e-10 (verify.h); a push adds to its
// state at once, which the controller only sees at its next measurement.
//
// A plan that is not usable is not followed: the one before it goes on.
//
// With `feedback` the plant corrects what acts by the plan's gains every so often (receding_horizon.h), and holds the correction in
// between: a push is answered before the next plan is there.
//
// Errors: those of RecedingHorizon; ArgumentError for times that are not positive, a delay of a period or more, a push
// of another size than the state.  A first plan that is not usable, and a plant that cannot be simulated, end the loop: `trouble` says
// why.
#pragma once

#include <functional>
#include <stop_token>

#include <dyntape/interface/control/mpc/receding_horizon.h>

namespace dyntape {

struct Disturbance {
  double at;               // s
  Eigen::VectorXd change;  // (n_x) of the state
  // In its place: the change, from the state then.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x)> of_state = {};
};

// A plant of another kind than the problem's own dynamics: moves x (n_x) from one time to another under controls (n_u), which it
// asks for as often as it likes.  Returns "", or why it cannot be simulated.
using SimulatedPlant = std::function<std::string(Eigen::VectorXd& x, double from, double to,
                                                 const std::function<Eigen::VectorXd(double t)>& control)>;

struct ClosedLoopOptions {
  double seconds = 3, period = 0.02, delay = 0;  // s
  double feedback = 0;                           // s between corrections by the plan's gains; 0: none
  MpcOptions mpc = {};
  std::vector<Disturbance> disturbances = {};
  SimulatedPlant plant = {};  // empty: the problem's own dynamics
  // Asked at every step: why the loop is over, a robot that fell say; "": it goes on.
  std::function<std::string(double t, const Eigen::VectorXd& x)> is_over = {};
  std::stop_token stop = {};
  std::function<void(double t)> watch = {};  // told of each step when it begins
};

struct ClosedLoop {
  struct Step {
    double t, seconds, gain_seconds, cost, violation;
    int iterations;
    SolveStatus status;
    bool usable;
  };
  Trajectory motion;  // of the plant at the times of steps, and the control that acted then
  std::vector<Step> steps;
  std::string trouble;
  BuildReport build;

  double latency(double share) const;  // s, that this share of the steps after the first did not exceed
  int missed(double deadline) const;   // steps after the first that took longer (s)
  int unusable() const;
};

ClosedLoop close_loop(const Problem& problem, const ClosedLoopOptions& options);

}  // namespace dyntape
