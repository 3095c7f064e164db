// SPDX-License-Identifier: BSD-3-Clause
//
// The gradient of what a motion costs, by its controls, its start and its parameters, in one sweep back over the
// motion.
//
//   Problem p = ...;                                     // costs, a start: what differential dynamic programming takes
//   RolloutAdjoint adjoint(p, {.intervals = 200});       // recorded, compiled: once
//   const RolloutGradient g = adjoint.discrete(u);       // u (n_u x N): held over each interval
//   g.cost, g.controls.col(k)                            // J, dJ/du_k
//
// discrete()    the gradient of the classical Runge-Kutta steps themselves, exact to rounding: with x_{k+1} = F_k(x_k, u_k)
//               and costs l_k
//                 lambda_N = dM/dx,  lambda_k = dl_k/dx + (dF_k/dx)^T lambda_{k+1},
//                 dJ/du_k = dl_k/du + (dF_k/du)^T lambda_{k+1}
//               With few checkpoints (checkpoints.h) memory for states does not grow with N, and no bit changes.
// continuous()  the adjoint equation of the motion, integrated backwards by as many Runge-Kutta steps along the states of
//               the roll-out (cubic between nodes)
//                 mu' = -(df/dx)^T mu - dL/dx,   mu(T) = dM/dx,   dJ/dp = + int (df/dp)^T mu + dL/dp dt
//               The integral counts forwards in time, hence the plus.  Both approach the gradient of the motion with
//               h^4, and so each other.
//
// The adjoint is the slope of the cost by the state with the controls held as they are.  The slope of the cost to go
// of a policy (ddp.h) is the same at an optimum only.
//
// Slopes of a parameter that is a function of time are by a number added to it at all times.  Limits of controls are
// not looked at.
//
// Errors: ArgumentError for a problem that steps do not know (record_stage.h), controls of another size;
// NumericalError where a step, or the cost of the end, is not finite.  GuardViolation where a recorded branch is left.
#pragma once

#include <memory>

#include <dyntape/codegen/options/options.h>
#include <dyntape/interface/control/problem/problem.h>

namespace dyntape {

struct RolloutOptions {
  int intervals = 100;
  long checkpoints = 0;  // states that discrete() keeps at most; 0: all
  CodegenOptions evaluation = {};
};

struct RolloutGradient {
  double cost = 0;
  Eigen::MatrixXd controls;    // (n_u x N)
  Eigen::VectorXd start;       // (n_x)
  Eigen::VectorXd parameters;  // (n_p)
  Eigen::MatrixXd adjoint;     // (n_x x N + 1) at the nodes; empty where checkpoints are few
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
