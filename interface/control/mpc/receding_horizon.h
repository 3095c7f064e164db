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
//   plant.apply(now.control(t, x));                              // as often as it likes, with MpcOptions::gains: feedback
//
// A step starts from the last solution, moved by the time that has passed: states and controls, multipliers and the barrier.  Nothing is
// compiled or recorded.  The first step is solved.  With `iterations` above 0 a later one makes so many steps of sequential quadratic
// programming at most: with one it is the real-time iteration, in which the plant moves while the solver converges.  Its status is
// then "iteration limit"; its cost is that of the quadratic model.
//
// Far from the plan, after a push say, the last solution's barrier is too low: to other limits it is a long way along the old ones.  So
// where the moved plan violates something by more than kFar nominal values, it is solved from with a new barrier.  What that gives no
// usable plan for is tried the other way, and then from the problem's own guess, whatever `iterations` says: only then is the verdict
// that of the problem and not of where the search began.  Measured on a cart-pole, a seven-joint arm and a robot as one mass: up to
// kFar going on takes 2 to 16 iterations and a new barrier 4 to 21; beyond, where limits are reached, 21 to 61 and 17 to 33.
//
// The first plan is checked to the second order (second_order.h), with differences of slopes where Hessians are Gauss-Newton's: on top of a
// hill every slope is zero.  A plan that is no minimum is left; if that fails, it is not called solved.
//
// What terms read as s.t is time within the horizon, from 0.  Parameters that are functions of time are asked at the plant's
// time: a reference r(t) is followed as it is.  They change in place through values().  The problem's guess is asked once for each time of
// the mesh and remembered; one that is set through values() is asked in every step.
//
// Without limits, these being soft (penalties.h), a step with `iterations` above 0 is a linear system (equality_qp.h), takes the same
// time whatever happens, and goes on from the last solution however far that is.
//
// A waypoint of the plant's time is likewise a running term with a parameter of time for its target, and another for its weight.
// One of the horizon (at_fraction(), problem.h), which would go on before the plant for ever, is refused; terms at the start of the
// horizon act on what the plant does now.
//
// A plan is usable if it is solved, or violates nothing by more than `violation` of the nominal values (nlp.h) that its numbers had at
// the first start: what one step of the real-time iteration leaves open falls from step to step, and stands in `violation`.
// Gauss-Newton, the default, needs every cost as squares; with exact Hessians whole steps may lead away.
//
// Feedback between steps.  Plans may have a gain: u = u_plan(t) + K (x - x_plan(t)), within the limits of controls, where
// K = d u(0) / d x(0) is how the first control of the problem changes with where it begins, to first order; the solver's last
// system is factored once more for it.  What is at a limit stays there, softened as the barrier has left it.  Where Gauss-Newton
// solves, the gain is its own.  A plan whose quadratic model has no minimum has none.  One gain serves until the next plan: it is that of
// a controller as fast as the mesh.  Later ones, which divide by what is left of the first state, ask for what no plant does
// within an interval: for the arm of config/control/arm_holds.info on intervals of 20 ms, poles at -6e4 /s in place of -97 /s.
//
// Errors: ArgumentError for a state of the wrong size or with entries that are no numbers, for times that go back, a problem whose
// start or duration is free, with a term between start and end of its horizon, and for what solve_with_riccati refuses.  How a solve
// ended is no error but a status.
//
// Source: M. Diehl, H. G. Bock, J. P. Schloeder, A real-time iteration scheme for nonlinear optimization in optimal feedback control, SIAM
// Journal on Control and Optimization 43(5), 2005.
#pragma once

#include <memory>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/mpc/equality_qp.h>
#include <dyntape/interface/control/mpc/qp_subproblem.h>
#include <dyntape/interface/control/mpc/triple_buffer.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/riccati/interior_point.h>

namespace dyntape {

struct MpcOptions {
  MeshOptions mesh = {.scheme = trapezoid(), .intervals = 20, .hessian = HessianKind::kGaussNewton};
  SolverOptions solver = {.tolerance = 1e-6};  // its method is kRiccati, whatever it says
  int iterations = 0;                          // of a step at most, but of the first; 0: until it is solved
  double violation = 1e-2;                     // of what is usable
  bool gains = false;                          // of plans
};

// What the plant is to do from a time on.  A value that any thread may read.
struct Plan {
  double begin = 0;   // s, plant's time
  Trajectory motion;  // times from 0

  // At the plant's time, that of the beginning or of the end where it lies beyond them.
  Eigen::VectorXd control(double t) const;
  Eigen::VectorXd state(
      double t) const;  // along cubics where there is a gain, else straight lines between points

  // With feedback: of a plant that is at x.  Without a gain the same as control(t).
  Eigen::VectorXd control(double t, const Eigen::VectorXd& x) const;
  Eigen::VectorXd correction(double t, const Eigen::VectorXd& x) const;  // (n_u) K (x - x_plan), limits apart
  Eigen::VectorXd limited(const Eigen::VectorXd& u) const {
    return u.cwiseMax(limits.lower).cwiseMin(limits.upper);
  }

  Eigen::MatrixXd gain;   // (n_u x n_x), or empty: none
  Eigen::MatrixXd rates;  // (n_x x points) x', where there is a gain
  Bounds limits;          // of controls
  // Problem::difference.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& from, const Eigen::VectorXd& x)> difference;
};

struct MpcStep {
  Plan plan;
  bool usable = false;
  bool is_minimum = true;  // of the first plan; later ones go on from it
  SolveStatus status = SolveStatus::kSolverError;
  int iterations = 0;
  double cost = 0, violation = 0;  // relative to nominal values
  double seconds = 0;              // from the call to the plan
  double gain_seconds = 0;         // of these, for the gain
};

class RecedingHorizon {
 public:
  static constexpr double kFar = 1.5;  // above

  RecedingHorizon(const Problem& problem, const MpcOptions& options = {});

  const MpcStep& step(double t, const Eigen::VectorXd& x);

  // Parameters, goal, bounds and costs' targets from the next step on; times of parameters are the plant's.
  Problem& values() { return values_; }
  TripleBuffer<Plan>& latest() { return latest_; }
  BuildReport build() const { return program_.build(); }

 private:
  std::vector<double> moved(double by);
  int quadratic_steps(std::vector<double> x);
  enum class From { kLastSolution, kPoint };

  void choose_derivatives(bool is_stepwise);
  void plan_from(const std::vector<double>& start, double t, From from);
  void plan_again(const std::vector<double>& start, const std::vector<double>& moved_plan, double t,
                  const Eigen::VectorXd& x);
  bool leave_saddle(double t);
  void add_gain();

  MpcOptions options_;
  Problem values_;
  StagedNlp program_;
  std::unique_ptr<ScaledNlp> scaled_;
  std::unique_ptr<StructuredInteriorPoint> solver_, of_model_;
  std::unique_ptr<QpSubproblem> model_;
  std::unique_ptr<EqualityQp> system_;  // of a model without limits; null: it has some
  std::function<Eigen::MatrixXd(const std::vector<std::size_t>& held)> derivatives_;  // of the plan
  NlpSolution last_;                                                                  // in scaled units
  MpcStep step_;
  TripleBuffer<Plan> latest_;
  bool has_plan_ = false;
};

}  // namespace dyntape
