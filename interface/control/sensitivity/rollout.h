// SPDX-License-Identifier: BSD-3-Clause
//
// The gradient of the cost of a simulated motion with respect to controls, start and parameters, in one backward
// sweep (adjoint method).
//
//   Problem p = ...;                                     // costs and a start, as for differential dynamic programming
//   RolloutAdjoint adjoint(p, {.intervals = 200});       // records and compiles once
//   const RolloutGradient g = adjoint.discrete(u);       // u (n_u x N): held over each interval
//   g.cost, g.controls.col(k)                            // J, dJ/du_k
//
// discrete()    the gradient of the classical Runge-Kutta steps, exact to rounding: with x_{k+1} = F_k(x_k, u_k) and
//               costs l_k
//                 lambda_N = dM/dx,  lambda_k = dl_k/dx + (dF_k/dx)^T lambda_{k+1},
//                 dJ/du_k = dl_k/du + (dF_k/du)^T lambda_{k+1}
//               With a limit on checkpoints (checkpoints.h) the memory for states does not grow with N; bits are equal.
// continuous()  the adjoint equation, integrated backwards by the same number of Runge-Kutta steps along the
// simulated
//               states (cubic between nodes)
//                 mu' = -(df/dx)^T mu - dL/dx,   mu(T) = dM/dx,   dJ/dp = + int (df/dp)^T mu + dL/dp dt
//               The integral runs forwards in time, hence the plus.
// Both converge to the gradient of the exact motion with h^4.
//
// The adjoint is the gradient of the cost with fixed controls.  The cost-to-go gradient of a policy (ddp.h) is equal
// only at an optimum.  If a parameter is a function of time, its gradient is with respect to a constant added to it.
// Limits of controls are ignored.
//
// Errors.  ArgumentError: a problem that record_stage.h does not support, controls of wrong size.  NumericalError: a
// step or the terminal cost is not finite.  GuardViolation: another branch than the recording.
#pragma once

#include <memory>

#include <dyntape/codegen/options/options.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct RolloutOptions {
  int intervals = 100;
  long checkpoints = 0;  // most states that discrete() stores; 0: all
  CodegenOptions evaluation = {};
};

struct RolloutGradient {
  double cost = 0;
  Eigen::MatrixXd controls;    // (n_u x N)
  Eigen::VectorXd start;       // (n_x)
  Eigen::VectorXd parameters;  // (n_p)
  Eigen::MatrixXd adjoint;     // (n_x x N + 1) at the nodes; empty if checkpoints are limited
  long forward_steps = 0;
};

class RolloutAdjoint {
 public:
  explicit RolloutAdjoint(const Problem& problem, const RolloutOptions& options = {});
  ~RolloutAdjoint();
  RolloutAdjoint(RolloutAdjoint&&) noexcept;
  RolloutAdjoint& operator=(RolloutAdjoint&&) noexcept;

  void set_values(const Problem& now);  // Problem::take_values
  RolloutGradient discrete(const Eigen::MatrixXd& u);
  RolloutGradient continuous(const Eigen::MatrixXd& u);

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
