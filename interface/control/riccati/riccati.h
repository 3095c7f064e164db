// SPDX-License-Identifier: BSD-3-Clause
//
// Linear-quadratic optimal control by stages, in time linear in their number.
//
//   minimise  sum_k ( 1/2 z_k.H_k z_k + g_k.z_k ) + 1/2 x_N.H_N x_N + g_N.x_N,      z = (x, u)
//   subject to  x_{k+1} = A_k x_k + B_k u_k + c_k,   x_0 given,   lower <= k_k <= upper where there are limits
//
//   Riccati riccati;
//   riccati.begin(H_N, g_N);
//   for (int k = N - 1; k >= 0; --k)                       // from the end to the start
//     if (!riccati.push(stage[k], shift)) ...              // no minimum there: H_uu + shift I is not positive definite
//   riccati.policy()                                       // of the stage pushed last: u = k + K x
//   riccati.P(), riccati.p()                               // 1/2 x.P x + p.x: the cost to go from its start, but for a constant
//
// One stage, with the cost to go P', p' of its end, m = p' + P' c and F = (A, B):
//   Q = H + F^T P' F,  q = g + F^T m,      Q_uu k = - q_u,  Q_uu K = - Q_ux,      P = Q_xx + Q_xu K,  p = q_x + Q_xu k
// and with a shift, or clamped inputs, P and p are those of the policy as it is: P = Q_xx + K^T Q_ux + Q_xu K + K^T Q_uu K.
// All Q_uu are positive definite if and only if the whole problem is strictly convex on its dynamics, whatever the H_k
// (its inertia is right); a shift > 0 makes up for what is missing.
//
// Limits are of the input at x = 0, k: the minimum within them by projected Newton steps; inputs at a limit have no gain.
// Q_uu need then be positive definite only among inputs that can move.
//
// Sources: J. Rawlings, D. Mayne, M. Diehl, Model Predictive Control, 2017, 1.3.3 and 8.8; Y. Tassa, N. Mansard, E. Todorov,
// Control-limited differential dynamic programming, ICRA 2014.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace dyntape {

struct LqrStage {
  Eigen::MatrixXd A, B;          // (n x n), (n x m)
  Eigen::VectorXd c;             // (n)
  Eigen::MatrixXd H;             // (n + m) x (n + m), the lower triangle of a symmetric matrix
  Eigen::VectorXd g;             // (n + m)
  Eigen::VectorXd lower, upper;  // (m), or empty: no limits
};

struct LqrPolicy {
  Eigen::MatrixXd K;  // (m x n)
  Eigen::VectorXd k;  // (m)
};

class Riccati {
 public:
  void begin(const Eigen::MatrixXd& H, const Eigen::VectorXd& g);
  bool push(const LqrStage& stage, double shift);

  const Eigen::MatrixXd& P() const { return P_; }
  const Eigen::VectorXd& p() const { return p_; }
  const LqrPolicy& policy() const { return policy_; }
  const Eigen::MatrixXd& input_curvature() const { return Q_uu_; }  // Q_uu + shift I of the stage that failed

 private:
  void add_cost_to_go(const LqrStage& stage);
  void minimise(Eigen::Index n, Eigen::Index m);

  Eigen::MatrixXd P_;
  Eigen::VectorXd p_;
  LqrPolicy policy_;
  // Working memory, most with rows padded (columns.h).
  Eigen::MatrixXd padded_P_, F_, Ft_, PF_, Q_, Q_uu_, L_, Lt_, W_, Wt_;
  Eigen::VectorXd slope_, q_, w_;
  Eigen::LLT<Eigen::MatrixXd> factors_;
};

// The minimum of 1/2 u.H u + g.u within lower <= u <= upper; H positive definite.  `is_free` says which entries are at no
// limit.  From u = 0 clamped.
Eigen::VectorXd box_minimum(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const Eigen::VectorXd& lower,
                            const Eigen::VectorXd& upper, std::vector<bool>& is_free);

}  // namespace dyntape
