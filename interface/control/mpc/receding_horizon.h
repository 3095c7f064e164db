// SPDX-License-Identifier: BSD-3-Clause
//
// Model predictive control: solves an optimal control problem repeatedly, each time from the measured state.
//
//   Problem p = ...;                                             // its duration is the horizon
//   RecedingHorizon mpc(p, {.mesh = {.intervals = 20}});         // records and compiles once
//   for (;;) {
//     const MpcStep& s = mpc.step(t, x);                         // state x measured at time t (s)
//     if (s.usable) plant.apply(s.plan.control(t));
//   }
//   const Plan& now = mpc.latest().read();                       // in another thread, after latest().take()
//   plant.apply(now.control(t, x));                              // at any rate; with MpcOptions::gains: feedback
//
// Steps.  A step is warm-started from the previous solution, shifted by the elapsed time: states, controls,
// multipliers and barrier parameter.  Nothing is compiled or recorded.
//
// - The first step is always solved to convergence.
// - If `iterations` is above 0, each later step does at most this number of iterations of sequential quadratic
// programming.  1 is the real-time iteration: the plant moves while the solver converges.
// - The status of such a step is "iteration limit"; its cost is the value of the quadratic model.
//
// Large deviations.  After a disturbance the barrier parameter of the previous solution is too small: other limits
// become active, and the path to them is long.  If the shifted plan, with x as its first state, violates a constraint
// by more than kFar nominal values, the step uses a new barrier parameter.  If this gives no usable plan, the step
// tries again with the other barrier parameter, then from the problem's initial guess.  Solves with a new barrier
// parameter ignore `iterations`.  Measured on a cart-pole, a seven-joint arm and a single-mass robot:
//
//                                     warm start           new barrier parameter
//   deviation up to kFar              2 to 16 iterations   4 to 21
//   beyond, where limits are active   21 to 61             17 to 33
//
// Second order.  The first plan is checked for a minimum (second_order.h), with finite differences of gradients if
// the Hessians are Gauss-Newton.  If it is a saddle or a maximum, another solve tries to leave it.  If that fails,
// the status is kAcceptable, not kSolved, and MpcStep::is_minimum is false.
//
// Time.  s.t in a term is the time within the horizon, from 0.  Parameters that are functions of time use the
// plant's time, so that a reference r(t) is followed.  values() changes parameters in place.  The problem's guess is
// evaluated once per mesh point and cached; a guess set through values() is evaluated in every step.
//
// Without limits.  If the problem has no limits, or soft limits only (penalties.h), and `iterations` is above 0, a
// step solves one linear system (equality_qp.h).  Its time is constant, and it always continues from the previous
// solution.
//
// Waypoints.  For a waypoint at a time of the plant, use a running term whose target and weight are parameters of
// time.  Terms at a fraction of the horizon (at_fraction(), problem.h) are refused, since they would move with the
// horizon.  Terms at the start of the horizon affect the current control.
//
// Usable plans.  A plan is usable if it is solved, or violates no constraint by more than `violation`, relative to
// the nominal values (nlp.h) of the first step.  Real-time iterations report their residual as `violation`; it
// decreases from step to step.  Gauss-Newton, the default, needs all costs as squares.  With exact Hessians full
// steps may diverge.
//
// Feedback between steps.  With `gains`, u = u_plan(t) + K (x - x_plan(t)), clamped to the limits of the controls.
// K = d u(0) / d x(0) is the derivative of the first control with respect to the initial state, to first order.
//
// - Cost: one more factorisation of the solver's last system.
// - Controls at a limit stay there, smoothed by the barrier.  With Gauss-Newton, K is the gain of that model.
// - A plan has no gain if its quadratic model has no minimum.
// - K is used until the next plan.  It suits a controller whose period is about one mesh interval.  A gain of a later
// interval would divide by the small remaining influence of the first state.  The loop would be too fast for a plant:
// for the arm of config/control/arm_holds.info on intervals of 20 ms, poles at -6e4 /s instead of -97 /s.
//
// Printed.  With `printed`, a step runs the C code for microcontrollers (printed/controller.h), compiled here.
// Results equal those of the microcontroller; steps mostly take less time.  Limits of states and path rows are soft;
// values() changes parameters only; solution() and derivatives are not available.
//
// Derivatives.  problem() and solution() are what motion_sensitivities.h needs for the derivatives of the whole plan
// with respect to the measured state and the parameters, with exact second derivatives:
//
//   MotionSensitivity sensitivity(p, options.mesh);                            // once
//   const MotionSensitivities by = sensitivity.at(mpc.problem(), mpc.solution());
//   if (by.good()) by.gain, by.parameters.x;                                   // du(0)/dx(0); of all variables by p
//
// A plan that has not converged after `iterations` is no solution: the status says so, and derivatives are NaN.
//
// Errors.  The result of a solve is a status, not an error.  ArgumentError for:
//
// - a state of the wrong size or not finite, or a time before the previous one
// - a problem with free start or free duration, or with a term between start and end of the horizon
// - problems that solve_with_riccati refuses
//
// Source: M. Diehl, H. G. Bock, J. P. Schloeder, A real-time iteration scheme for nonlinear optimization in optimal
// feedback control, SIAM Journal on Control and Optimization 43(5), 2005.
#pragma once

#include <memory>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include <dyntape/interface/control/mpc/equality_qp.h>
#include <dyntape/interface/control/mpc/qp_subproblem.h>
#include <dyntape/interface/control/mpc/triple_buffer.h>
#include <dyntape/interface/control/nlp/scaled_nlp.h>
#include <dyntape/interface/control/printed/controller_library.h>
#include <dyntape/interface/control/riccati/interior_point.h>

namespace dyntape {

struct MpcOptions {
  MeshOptions mesh = {.scheme = trapezoid(), .intervals = 20, .hessian = HessianKind::kGaussNewton};
  SolverOptions solver = {.tolerance = 1e-6};  // its method is ignored: always kRiccati
  int iterations = 0;       // most iterations of a step after the first; 0: until convergence
  double violation = 1e-2;  // limit for usable plans, in nominal values
  bool gains = false;       // compute feedback gains
  bool printed = false;     // run the printed C code; same conditions as generate_controller
};

// The planned motion from time `begin` on.  A plain value; several threads may read it.
struct Plan {
  double begin = 0;   // s, plant's time
  Trajectory motion;  // times from 0

  // At the plant's time, clamped to the times of the plan.
  Eigen::VectorXd control(double t) const;
  Eigen::VectorXd state(double t) const;  // cubic interpolation if there is a gain, else linear

  // The control with feedback, for the measured state x.  If there is no gain: control(t).
  Eigen::VectorXd control(double t, const Eigen::VectorXd& x) const;
  Eigen::VectorXd correction(double t,
                             const Eigen::VectorXd& x) const;  // (n_u) K (x - x_plan), without limits
  Eigen::VectorXd limited(const Eigen::VectorXd& u) const {
    return u.cwiseMax(limits.lower).cwiseMin(limits.upper);
  }

  Eigen::MatrixXd gain;   // (n_u x n_x), or empty
  Eigen::MatrixXd rates;  // (n_x x points) x', if there is a gain
  Bounds limits;          // of controls
  // Problem::difference.
  std::function<Eigen::VectorXd(const Eigen::VectorXd& from, const Eigen::VectorXd& x)> difference;
};

struct MpcStep {
  Plan plan;
  bool usable = false;
  bool is_minimum = true;  // of the first plan; later plans continue from it
  SolveStatus status = SolveStatus::kSolverError;
  int iterations = 0;
  double cost = 0, violation = 0;  // violation: relative to nominal values
  double seconds = 0;              // from the call to the plan
  double gain_seconds = 0;         // part of `seconds` spent on the gain
};

class RecedingHorizon {
 public:
  static constexpr double kFar = 1.5;  // nominal values, see above

  RecedingHorizon(const Problem& problem, const MpcOptions& options = {});

  const MpcStep& step(double t, const Eigen::VectorXd& x);

  // Changes parameters, goal, bounds and targets of costs from the next step on; parameters use the plant's time.
  Problem& values() { return values_; }
  TripleBuffer<Plan>& latest() { return latest_; }
  BuildReport build() const { return program_.build(); }

  // The problem of the last step, with the measured state as its start and parameters in the time of the horizon, and
  // its solution.  solution() throws ArgumentError before the first step.
  const Problem& problem() const { return program_.problem(); }
  NlpSolution solution() const;

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
  const MpcStep& printed_step(double t, const Eigen::VectorXd& x);
  void check_step(double t, const Eigen::VectorXd& x) const;

  MpcOptions options_;
  Problem values_;
  StagedNlp program_;
  std::unique_ptr<ControllerLibrary> printed_;  // null unless asked for
  std::unique_ptr<ScaledNlp> scaled_;
  std::unique_ptr<StructuredInteriorPoint> solver_, of_model_;
  std::unique_ptr<QpSubproblem> model_;
  std::unique_ptr<EqualityQp> system_;  // for a model without limits; null if there are limits
  std::function<Eigen::MatrixXd(const std::vector<std::size_t>& held)> derivatives_;  // of the plan
  NlpSolution last_;                                                                  // in scaled units
  MpcStep step_;
  TripleBuffer<Plan> latest_;
  bool has_plan_ = false;
};

}  // namespace dyntape
