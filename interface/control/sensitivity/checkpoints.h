// SPDX-License-Identifier: BSD-3-Clause
//
// The reverse sweep of a long row of steps with few of its states in memory.
//
//   x_{k+1} = forward(k, x_k),  k = 0 .. N-1;      adjoint of x_k = back(k, x_k, adjoint of x_{k+1})
//
//   const ReverseSweep r = reverse_sweep(1000000, 20, x0, {
//       .forward = [&](long k, const VectorXd& x, VectorXd& next) { next = ...; },
//       .end = [&](const VectorXd& x) { return slope_of_cost(x); },                          // adjoint of x_N
//       .back = [&](long k, const VectorXd& x, VectorXd& adjoint) { adjoint = A(k, x).transpose() * adjoint; }});
//   r.adjoint                                                                                // of x_0: the gradient
//
// What back() needs besides x_k it may gather itself: derivatives by controls, by parameters.  It is called once for each
// k, from N - 1 down to 0, with the same bits of x_k whatever is kept: so the gradient has the same bits, too.
//
// Kept are `checkpoints` states at most, x_0 among them, and one more that moves.  What is not kept is found again from
// the last that is, with the fewest steps there can be: binomial checkpointing.  With s checkpoints, no step is taken more
// than r times, the least with beta(s, r) >= N, and
//   fewest(N, s) = r N - beta(s + 1, r - 1),     beta(s, r) = (s + r)! / (s! r!)
// and one more, the last, that brings x_N itself.  With s = N all is kept and a step is taken once; s = 1 takes
// N (N - 1) / 2.  A million steps with 20 checkpoints take 6.8 million.  Memory that grows with the root of N takes two or
// three times N, with log N some N log N.
//
// To find states by integrating backwards in time would need no memory, and is no gradient: what contracts grows
// then, noise first.
//
// Errors: ArgumentError for less than one checkpoint, a negative number of steps, a function that is missing.
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
  long forward_steps = 0;   // fewest_forward_steps() and the last
  long stored = 0;          // most checkpoints at a time
};

ReverseSweep reverse_sweep(long steps, long checkpoints, const Eigen::VectorXd& x0,
                           const ReversibleSteps& of);

// Without the last.  The largest long: more than that.
long fewest_forward_steps(long steps, long checkpoints);

}  // namespace dyntape
