// SPDX-License-Identifier: BSD-3-Clause
//
// Model predictive control: an optimal control problem solved again and again from where the plant is.
//
//   Problem p = ...;                                             // its duration is the horizon
//   RecedingHorizon mpc(p, {.mesh = {.intervals = 20}});         // recorded, compiled: once
//   for (;;) {
//     const MpcStep& s = mpc.step(t, x);                         // state x measured at time t (s)
//     if (s.usable) plant.apply(s.plan.control(t));
//   }
//   const Plan& now = mpc.latest().read();                       // in another thread, after latest().take()
//
// A step starts from the last solution, moved by the time that has passed: states and controls, multipliers and the barrier.  Nothing is
// compiled or recorded.  The first step is solved.  With `iterations` above 0 a later one makes so many steps of sequential quadratic
// programming at most: with one it is the real-time iteration, in which the plant moves while the solver converges.  Its status is
// then "iteration limit"; its cost is that of the quadratic model.
//
// What going on from the last solution gives no usable plan for, a push say, is solved from the problem's own guess, whatever `iterations`
// says: only then is the verdict that of the problem and not of where the search began.
//
// What terms read as s.t is time within the horizon, from 0.  Parameters that are functions of time are asked at the plant's
// time: a reference r(t) is followed as it is.  They change in place through values().
//
// A waypoint of the plant's time is likewise a running term with a parameter of time for its target, and another for its weight.
// One of the horizon (at_share(), problem.h), which would go on before the plant for ever, is refused; terms at the start of the
// horizon act on what the plant does now.
//
// A plan is usable if it is solved, or violates nothing by more than `violation` of the magnitudes (nlp.h) that its numbers had at
// the first start: what one step of the real-time iteration leaves open falls from step to step, and stands in `violation`.
// Gauss-Newton, the default, needs every cost as squares; with exact Hessians whole steps may lead away.
//
// Errors: ArgumentError for a state of the wrong size or with entries that are no numbers, for times that go back, a problem whose
// start or duration is free, with a term between start and end of its horizon, and for what solve_by_stages refuses.  How a solve
// ended is no error but a status.
//
// Source: M. Diehl, H. G. Bock, J. P. Schloeder, A real-time iteration scheme for nonlinear optimization in optimal feedback control, SIAM
// Journal on Control and Optimization 43(5), 2005.
#pragma once

#include <memory>

#include <dyntape/interface/mpc/latest.h>
#include <dyntape/interface/solvers/interior_point.h>
#include <dyntape/interface/solvers/quadratic_model.h>
#include <dyntape/interface/solvers/scaled_nlp.h>
#include <dyntape/interface/transcription/collocation.h>

namespace dyntape {

struct MpcOptions {
  MeshOptions mesh = {.scheme = trapezoid(), .intervals = 20, .hessian = HessianKind::kGaussNewton};
  SolverOptions solver = {.tolerance = 1e-6};  // its method is kStages, whatever it says
  int iterations = 0;                          // of a step at most, but of the first; 0: until it is solved
  double violation = 1e-2;                     // of what is usable
};

// What the plant is to do from a time on.
struct Plan {
  double begin = 0;   // s, plant's time
  Trajectory motion;  // times from 0

  // At the plant's time, that of the beginning or of the end where it lies beyond them.
  Eigen::VectorXd control(double t) const;
  Eigen::VectorXd state(double t) const;  // along straight lines between points
};

struct MpcStep {
  Plan plan;
  bool usable = false;
  SolveStatus status = SolveStatus::kSolverError;
  int iterations = 0;
  double cost = 0, violation = 0;  // relative to magnitudes
  double seconds = 0;              // from the call to the plan
};

class RecedingHorizon {
 public:
  RecedingHorizon(const Problem& problem, const MpcOptions& options = {});

  const MpcStep& step(double t, const Eigen::VectorXd& x);

  // Parameters, goal, bounds and costs' targets from the next step on; times of parameters are the plant's.
  Problem& values() { return values_; }
  Latest<Plan>& latest() { return latest_; }
  BuildReport build() const { return program_.build(); }

 private:
  std::vector<double> moved(double by);
  int quadratic_steps(std::vector<double> x);
  void plan_from(const std::vector<double>& start, double t, bool goes_on);

  MpcOptions options_;
  Problem values_;
  Collocation program_;
  std::unique_ptr<ScaledNlp> scaled_;
  std::unique_ptr<StageSolver> solver_, of_model_;
  std::unique_ptr<QuadraticModel> model_;
  NlpSolution last_;  // in scaled units
  MpcStep step_;
  Latest<Plan> latest_;
  bool has_plan_ = false;
};

}  // namespace dyntape
