// SPDX-License-Identifier: BSD-3-Clause
//
// Differential dynamic programming: an optimal control problem by Newton steps that go from stage to stage.
//
//   Problem p = ...;                                             // costs, limits of controls, a start (problem.h)
//   const DdpSolution s = solve_with_ddp(p, {.intervals = 100});
//   if (s.success()) use(s.u, s.policy[k].K);                    // u = u_k + K_k (x - x_k) at node k
//
// The controls are held over N intervals, each one step of state and costs, by the classical Runge-Kutta scheme or by Euler's.  An iteration
// linearises all steps, makes the cost quadratic, solves that problem by the Riccati recursion (riccati.h), and rolls the
// true dynamics out with the policy, shortened until the merit goes down.
//   kExact          with the curvature of the dynamics, contracted with the slope of the cost to go: quadratic convergence
//   kGaussNewton    without it (iLQR), of running costs that are squares: first derivatives are all it needs, an iteration takes
//                   a tenth; where they show that much is missing, secants of the stages take its place (stage_secants.h)
// Starts.  kRollOut: the guess's controls from the given start.  kNodes: also its states, which need not be a motion: what is
// missing between two nodes is closed by the share of the step that is taken (multiple shooting; the merit counts it).
//
// What it ends with.  `slope[k]` is the gradient of the cost to go at node k, by the policy; `adjoint[k]` that of the
// Lagrangian, lambda_k = L_x + A^T lambda_{k+1}.  At a solution they are the same, before they are not.
//   solved      of each control the largest projected slope, L_u + B^T lambda, is below `tolerance` times the largest
//               |L_u| + |B^T lambda| there is, or the whole step is below `tolerance` times the size of the controls, of
//               Gauss-Newton's all that would follow as well, from the ratio by which they get shorter; and no gap
//               is left (tolerance times the size of the states).  That is first order: a maximum or a saddle has no slope
//               either: these are left, along the most negative
//               curvature with kExact, along a few trial changes with kGaussNewton; where that fails is_minimum is false.  Costs of the end alone that can be met exactly have no such sizes left: these
//               end as "step too small".
//   acceptable  1e4 times that, where the cost's rounding allows no less, as with kGaussNewton, whose derivatives fall with the root
//               of what the cost is off by
// sensitivities: how cost and motion change with parameters and start, where options.sensitivities asks (ddp_sensitivities.h).
// verification: each interval re-simulated with its held control, and the costs with it (verify.h); success() asks for it.
//
// Errors: ArgumentError for what the method does not know (record_stage.h), for a guess that does not fit; NumericalError
// where the functions are not finite at the start.  How the solve ended is no error but a status.
//
// Sources: D. Jacobson, D. Mayne, Differential Dynamic Programming, 1970; W. Li, E. Todorov, ICINCO 2004 (iLQR); M. Giftthaler
// et al., A family of iterative Gauss-Newton shooting methods, IROS 2018 (gaps); Y. Tassa et al., ICRA 2014 (limits).
#pragma once

#include <memory>

#include <dyntape/interface/control/discretize/evaluation.h>
#include <dyntape/interface/control/solve/ddp_solution.h>

namespace dyntape {

class DdpDerivatives;

DdpSolution solve_with_ddp(const Problem& problem, const DdpOptions& options = {});

// Re-simulates a motion: sets `verification` and `integration_error`.
void add_verification(const Problem& problem, DdpSolution& solution, const std::stop_token& stop = {});

// Several solves with functions that are recorded and compiled once:
//
//   DdpSolver solver(problem, {.intervals = 100});
//   DdpSolution s = solver.solve();
//   Problem now = solver.problem();
//   now.start = measured, now.parameters.set("target", target);
//   solver.set_values(now);                                  // Problem::take_values
//   s = solver.solve();
class DdpSolver {
 public:
  explicit DdpSolver(const Problem& problem, const DdpOptions& options = {});
  DdpSolver(DdpSolver&&) noexcept;
  DdpSolver& operator=(DdpSolver&&) noexcept;
  ~DdpSolver();

  const Problem& problem() const;       // with the values of now
  void set_values(const Problem& now);  // ArgumentError where they do not fit, and then nothing has changed
  DdpSolution solve(const std::stop_token& stop = {});  // one that can stop takes the place of the options'
  BuildReport build() const;                            // of the functions, which were made once
  // record_shooting()'s, compiled.
  const CompiledFunction& step() const;
  const CompiledFunction& end() const;
  const DdpDerivatives* derivatives() const;  // null where options.sensitivities asks for nothing

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
