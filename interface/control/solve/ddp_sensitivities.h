// SPDX-License-Identifier: BSD-3-Clause
//
// How the solutions of differential dynamic programming change with parameters and start, to first order.
//
//   Problem p = ...;                                                           // with p.parameters "load", "target" (2 entries)
//   const DdpSolution s = solve_with_ddp(p, {.intervals = 100, .sensitivities = SensitivitiesOf::kMotion});
//   if (s.sensitivities.good()) {
//     const MotionDerivatives& by = s.sensitivities.parameters;                   // columns "load", "target[0]", "target[1]"
//     by.cost[0];                                                               // dJ/dload, cost a kg
//     by.x.col(0).reshaped(4, 101);                                             // dx/dload, a column a node
//     by.u.col(2).reshaped(1, 100);                                             // du/dtarget[1]
//   }
//   batch.solve({.starts = starts})[7].sensitivities                            // DdpBatch: of each, with the bits it has alone
//
// Shapes, N intervals, n_p entries of parameters: x (n_x (N + 1) x n_p), u (n_u N x n_p), cost (n_p), `start` the same with n_x
// columns.  u of start begins with policy[0].K of an exact solve.
//
// Method.  Offsets d of the parameters become states of rate zero that begin at zero: w = (x, d), parameters p + d.  One
// linearisation and one Riccati recursion (riccati.h) of that problem at the solution, with the exact second derivatives of its
// Lagrangian by lambda, give
//   cost      dJ/dw_0 = lambda_0,       lambda_k = L_w + F_w^T lambda_{k+1}: the envelope theorem, first derivatives alone
//   motion    du_k = K_k dw_k,          dw_{k+1} = (A_k + B_k K_k) dw_k
// which is the step of Newton's method from one solution to the next, hence the derivative (implicit function theorem).  It costs
// what an iteration of kExact costs, of a problem with n_p more states; second derivatives of parameters among themselves are
// evaluated too.
//   kExact, kGaussNewton    The same: second derivatives are exact here however the problem was solved, and their functions are
//                           recorded and compiled beside those of the solve
//   limits                  a control that is held at its limit does not move: rows of zeros
//
// status:
//   kGood
//   kWeaklyActive     a control rests on its limit without force, or is free within a rounding of it (1e-6 of the sizes): the motion
//                     has another derivative to either side, of which this is one; the cost's holds
//   kNoStrictMinimum  a stage has no minimum among what is free, as at a saddle: the motion's are NaN, the cost's hold
//   kNotASolution     the solve had no success: NaN
//   kNotFinite        the functions have no finite derivatives there: NaN
// A solution is as good as its tolerance; derivatives are off by a multiple of what it is off by.
//
// Sources: A. V. Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear Programming, 1983, 3.2 and 3.4 (implicit
// function and envelope theorem); W. Jin et al., Pontryagin Differentiable Programming, NeurIPS 2020 (the recursion).
#pragma once

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/control/problem/record_stage.h>
#include <dyntape/interface/control/solve/ddp_solution.h>

namespace dyntape {

// By w_0 = (x_0, d), a column an entry.
struct ChangesOfMotion {
  // NaN; without motion x and u are empty.
  ChangesOfMotion(Eigen::Index n_w, Eigen::Index n_u, Eigen::Index intervals, bool with_motion);

  Eigen::VectorXd cost;
  Eigen::MatrixXd x, u;  // (n_w (N + 1) x n_w) of all w, (n_u N x n_w)
};
DdpSensitivities sensitivities_of(SensitivityStatus status, const ChangesOfMotion& changes, Eigen::Index n_x);

// Weakly held: less force than this share of the largest slope of that control, or less distance from a limit than this share of
// the largest control.
constexpr double kWeaklyHeld = 1e-6;

// What it takes, recorded and compiled once.
class DdpDerivatives {
 public:
  // options.sensitivities: kCost or kMotion.
  DdpDerivatives(const Problem& problem, const DdpOptions& options);

  // `now`: the problem with the values that were solved with.
  DdpSensitivities at(const Problem& now, const DdpSolution& solution) const;

  bool is_of_motion() const { return is_of_motion_; }
  // record_shooting()'s of the problem whose states are w; the parameters that they ask for are those of the problem itself.
  const CompiledFunction& step() const { return step_; }
  const CompiledFunction& end() const { return end_; }

 private:
  DdpDerivatives(const RecordedShooting& recorded, const DdpOptions& options);

  bool is_of_motion_;
  CompiledFunction step_, end_;
};

}  // namespace dyntape
