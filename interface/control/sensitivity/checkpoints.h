// SPDX-License-Identifier: BSD-3-Clause
//
// A backward sweep over many steps with few states in memory (binomial checkpointing).
//
//   x_{k+1} = forward(k, x_k),  k = 0 .. N-1;      adjoint of x_k = back(k, x_k, adjoint of x_{k+1})
//
//   const ReverseSweep r = reverse_sweep(1000000, 20, x0, {
//       .forward = [&](long k, const VectorXd& x, VectorXd& next) { next = ...; },
//       .end = [&](const VectorXd& x) { return slope_of_cost(x); },                          // adjoint of x_N
//       .back = [&](long k, const VectorXd& x, VectorXd& adjoint) { adjoint = A(k, x).transpose() * adjoint; }});
//   r.adjoint                                                                                // of x_0: the gradient
//
// back() may also compute other results from x_k, e.g. derivatives with respect to controls and parameters.  back()
// is called once for each k from N - 1 to 0, always with the same bits of x_k.  So the gradient's bits do not depend
// on the number of checkpoints.
//
// Memory: at most `checkpoints` states, including x_0, and one moving state.  Other states are recomputed from the
// last stored one, with the fewest possible steps.  With s checkpoints, no step is computed more than r times, the
// least r with beta(s, r) >= N, and
//   fewest(N, s) = r N - beta(s + 1, r - 1),     beta(s, r) = (s + r)! / (s! r!)
// plus one last step to x_N.  s = N stores all states and computes each step once; s = 1 computes N (N - 1) / 2
// steps.  A million steps with 20 checkpoints take 6.8 million.  Memory proportional to the root of N takes two or
// three times N steps; proportional to log N, about N log N.
//
// States must not be recomputed by integrating backwards in time: contracting motions then diverge, noise first.
//
// Errors.  ArgumentError: fewer than one checkpoint, a negative number of steps, a missing function.
//
// Source: A. Griewank, A. Walther, Algorithm 799: revolve, ACM Transactions on Mathematical Software 26(1), 2000,
// theorem 1.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace dyntape {

struct ReversibleSteps {
  std::function<void(long k, const Eigen::VectorXd& x, Eigen::VectorXd& next)> forward;
  std::function<Eigen::VectorXd(const Eigen::VectorXd& x)> end;
  std::function<void(long k, const Eigen::VectorXd& x, Eigen::VectorXd& adjoint)> back;  // in place
};

struct ReverseSweep {
  Eigen::VectorXd adjoint;  // of x_0
  long forward_steps = 0;   // fewest_forward_steps() plus the last step
  long stored = 0;          // most states stored at a time
};

ReverseSweep reverse_sweep(long steps, long checkpoints, const Eigen::VectorXd& x0,
                           const ReversibleSteps& of);

// Without the last step.  If the number exceeds the range of long, returns the largest long.
long fewest_forward_steps(long steps, long checkpoints);

}  // namespace dyntape
