// SPDX-License-Identifier: BSD-3-Clause
//
// Solves an optimal control problem by differential dynamic programming.  Use it for problems without state
// constraints: it is fast, and returns a feedback policy.
//
//   Problem p = ...;                                             // costs, limits of controls, a start (problem.h)
//   const DdpSolution s = solve_with_ddp(p, {.intervals = 100});
//   if (s.success()) use(s.u, s.policy[k].K);                    // u = u_k + K_k (x - x_k) at node k
//
// Method.  Controls are constant on N intervals; each interval is one step of state and costs, by the classical
// Runge-Kutta scheme or Euler's.  An iteration linearises all steps, expands the cost to second order, solves the
// linear-quadratic problem by the Riccati recursion (riccati.h), and simulates the policy with a step length that
// reduces the merit function.
//   kExact          includes second derivatives of the dynamics times the cost-to-go gradient; converges quadratically
//   kGaussNewton    without them (iLQR); running costs must be squares.  Needs first derivatives only; an iteration
//                   takes a tenth of the time.  If the missing curvature is large, secants of the stages replace it
//                   (stage_secants.h)
//
// Start.  kRollOut: simulates the guess's controls from the given start.  kNodes: also uses the guess's states,
// which need not satisfy the dynamics.  A step of length l reduces each gap to 1 - l of its size (multiple shooting);
// the merit function includes the gaps.
//
// Result.  `slope[k]` is the gradient of the policy's cost to go at node k.  `adjoint[k]` is the gradient of the
// Lagrangian, lambda_k = L_x + A^T lambda_{k+1}.  The two are equal only at a solution.
//
// Status "solved": no gap exceeds `tolerance` times the largest state, and one of these holds:
//
// - For each control, the largest projected gradient L_u + B^T lambda is below `tolerance` times the largest |L_u| +
// |B^T lambda|.
// - The full step is below `tolerance` times the size of the controls.  With Gauss-Newton the sum of all further
// steps counts, estimated from the ratio of successive steps.
//
// These are first-order conditions, which maxima and saddles also satisfy.  The solver leaves such points, along the
// most negative curvature with kExact, along a few trial changes with kGaussNewton.  If that fails, is_minimum is
// false.  If terminal costs can be met exactly, |L_u| + |B^T lambda| vanishes too: the status is "step too small".
//
// Status "acceptable": gradients within 1e4 times the tolerance and gaps within 1e-6, if the rounding of the cost
// allows no better.  This is common with kGaussNewton, whose gradients decrease as the root of the cost's error.
//
// Further results: `sensitivities`, derivatives of cost and motion with respect to parameters and start, if
// options.sensitivities (ddp_sensitivities.h).  `verification`, each interval and its costs re-simulated with the
// constant control (verify.h), required by success().
//
// Errors.  The result of a solve is a status, not an error.  ArgumentError: a problem that record_stage.h does not
// support, a guess that does not fit.  NumericalError: functions that are not finite at the start.
//
// Sources: D. Jacobson, D. Mayne, Differential Dynamic Programming, 1970; W. Li, E. Todorov, ICINCO 2004 (iLQR); M.
// Giftthaler et al., A family of iterative Gauss-Newton shooting methods, IROS 2018 (gaps); Y. Tassa et al., ICRA
// 2014 (limits).
#pragma once

#include <memory>

#include <dyntape/interface/control/discretize/evaluation.h>
#include <dyntape/interface/control/solve/ddp_solution.h>

namespace dyntape {

class DdpDerivatives;

DdpSolution solve_with_ddp(const Problem& problem, const DdpOptions& options = {});

// Re-simulates the motion: sets `verification` and `integration_error`.
void add_verification(const Problem& problem, DdpSolution& solution, const std::stop_token& stop = {});

// Solves repeatedly with functions that are recorded and compiled once:
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

  const Problem& problem() const;       // with the current values
  void set_values(const Problem& now);  // ArgumentError if they do not fit; then nothing changes
  DdpSolution solve(const std::stop_token& stop = {});  // a valid `stop` replaces the token of the options
  BuildReport build() const;                            // of compiling the functions
  // The compiled functions of record_shooting().
  const CompiledFunction& step() const;
  const CompiledFunction& end() const;
  const DdpDerivatives* derivatives() const;  // null without options.sensitivities

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
