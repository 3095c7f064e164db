// SPDX-License-Identifier: BSD-3-Clause
//
// First-order derivatives of solutions of differential dynamic programming with respect to parameters and start.
//
//   Problem p = ...;                                               // with p.parameters "load", "target" (2 entries)
//   const DdpSolution s = solve_with_ddp(p, {.intervals = 100, .sensitivities = SensitivitiesOf::kMotion});
//   if (s.sensitivities.good()) {
//     const MotionDerivatives& by = s.sensitivities.parameters;             // columns "load", "target[0]", "target[1]"
//     by.cost[0];                                                               // dJ/dload, cost per kg
//     by.x.col(0).reshaped(4, 101);                                             // dx/dload, one column per node
//     by.u.col(2).reshaped(1, 100);                                             // du/dtarget[1]
//   }
//   batch.solve({.starts = starts})[7].sensitivities                         // DdpBatch: same bits as a single solve
//
// Shapes, with N intervals and n_p parameter entries: x (n_x (N + 1) x n_p), u (n_u N x n_p), cost (n_p); `start`
// likewise with n_x columns.  The first block of u of `start` is policy[0].K of an exact solve.
//
// Method.  Offsets d of the parameters become states with rate zero and start zero: w = (x, d), parameters p + d.
// One linearisation and one Riccati recursion (riccati.h) at the solution, with exact second derivatives of the
// Lagrangian, give
//   cost      dJ/dw_0 = lambda_0,   lambda_k = L_w + F_w^T lambda_{k+1}: the envelope theorem, first derivatives only
//   motion    du_k = K_k dw_k,          dw_{k+1} = (A_k + B_k K_k) dw_k
// This is the Newton step from one solution to a neighbouring one, hence the derivative (implicit function theorem).
// Cost: one iteration of kExact with n_p more states; the unused second derivatives between parameters are evaluated
// too.
//
// - kExact and kGaussNewton give the same derivatives: second derivatives are exact here.  Their functions are
// recorded and compiled in addition to those of the solve.
// - A control at its limit does not move: its rows are zero.
//
// status:
//   kGood
//   kWeaklyActive     a control is at its limit with zero multiplier, or free but within 1e-6 of it (relative): the
//                     motion has one-sided derivatives, of which this is one; the cost's derivative is valid
//   kNoStrictMinimum  a stage has no minimum in the free controls, as at a saddle: motion NaN, cost valid
//   kNotASolution     the solve was not successful: NaN
//   kNotFinite        the derivatives of the functions are not finite: NaN
// Errors of derivatives are proportional to the error of the solution, hence to its tolerance.
//
// Sources: A. V. Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear Programming, 1983, 3.2 and 3.4
// (implicit function and envelope theorem); W. Jin et al., Pontryagin Differentiable Programming, NeurIPS 2020 (the
// recursion).
#pragma once

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/control/problem/record_stage.h>
#include <dyntape/interface/control/solve/ddp_solution.h>

namespace dyntape {

// Derivatives with respect to w_0 = (x_0, d), one column per entry.
struct ChangesOfMotion {
  // Initialised with NaN; without motion, x and u are empty.
  ChangesOfMotion(Eigen::Index n_w, Eigen::Index n_u, Eigen::Index intervals, bool with_motion);

  Eigen::VectorXd cost;
  Eigen::MatrixXd x, u;  // (n_w (N + 1) x n_w) for all w, (n_u N x n_w)
};
DdpSensitivities sensitivities_of(SensitivityStatus status, const ChangesOfMotion& changes, Eigen::Index n_x);

// Limit of weak activity: a multiplier below this fraction of the control's largest gradient, or a distance from the
// limit below this fraction of the largest control.
constexpr double kWeaklyHeld = 1e-6;

// The functions for the derivatives, recorded and compiled once.
class DdpDerivatives {
 public:
  // options.sensitivities: kCost or kMotion.
  DdpDerivatives(const Problem& problem, const DdpOptions& options);

  // `now`: the problem with the values of the solve.
  DdpSensitivities at(const Problem& now, const DdpSolution& solution) const;

  bool is_of_motion() const { return is_of_motion_; }
  // The functions of record_shooting() for the problem with states w; their parameters are those of the problem.
  const CompiledFunction& step() const { return step_; }
  const CompiledFunction& end() const { return end_; }

 private:
  DdpDerivatives(const RecordedShooting& recorded, const DdpOptions& options);

  bool is_of_motion_;
  CompiledFunction step_, end_;
};

}  // namespace dyntape
