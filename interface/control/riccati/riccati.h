// SPDX-License-Identifier: BSD-3-Clause
//
// Solves linear-quadratic optimal control problems by stages (Riccati recursion), in time linear in their number.
//
//   minimise  sum_k ( 1/2 z_k.H_k z_k + g_k.z_k ) + 1/2 x_N.H_N x_N + g_N.x_N,      z = (x, u)
//   subject to  x_{k+1} = A_k x_k + B_k u_k + c_k,   x_0 given,   lower <= k_k <= upper if there are limits
//
//   Riccati riccati;
//   riccati.begin(H_N, g_N);
//   for (int k = N - 1; k >= 0; --k)                       // from the end to the start
//     if (!riccati.push(stage[k], shift)) ...              // no minimum: H_uu + shift I is not positive definite
//   riccati.policy()                                       // of the stage pushed last: u = k + K x
//   riccati.P(), riccati.p()                               // 1/2 x.P x + p.x: its cost-to-go, up to a constant
//
// One stage, with the cost-to-go P', p' of its end, m = p' + P' c and F = (A, B):
//   Q = H + F^T P' F,  q = g + F^T m,      Q_uu k = - q_u,  Q_uu K = - Q_ux,      P = Q_xx + Q_xu K,  p = q_x + Q_xu k
// With a shift, or clamped inputs, P and p are those of the policy: P = Q_xx + K^T Q_ux + Q_xu K + K^T Q_uu K.  All
// Q_uu are positive definite if and only if the whole problem is strictly convex on its dynamics, for any H_k (its
// inertia is right).  A shift > 0 (regularization) makes them positive definite.
//
// Limits apply to k, the input at x = 0: the minimum within them is found by projected Newton steps; inputs at a
// limit have zero gain.  Q_uu then needs to be positive definite only for inputs inside their limits.
//
// Sources: J. Rawlings, D. Mayne, M. Diehl, Model Predictive Control, 2017, 1.3.3 and 8.8; Y. Tassa, N. Mansard, E.
// Todorov, Control-limited differential dynamic programming, ICRA 2014.
#pragma once

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

// The parts of a stage for its gradient, F = (A | B).
struct StageSlopes {
  Eigen::MatrixXd Ft;  // (padded(n + m) x n)
  Eigen::VectorXd g;   // (padded(n + m))
};

// A stage in the layout of the recursion: columns padded() with zeros (columns.h).
struct StageColumns : StageSlopes {
  StageColumns() = default;
  StageColumns(Eigen::Index n, Eigen::Index m);  // zeros
  explicit StageColumns(const LqrStage& stage);

  Eigen::Index n = 0, m = 0;
  Eigen::MatrixXd H;             // (padded(n + m) x n + m) both triangles
  Eigen::VectorXd c;             // (n)
  Eigen::VectorXd lower, upper;  // (m), or empty: no limits
};

// to += F^T lambda;  next = c + F z;  z.H z.  z and `to` have padded(n + m) entries, lambda and next n.
void add_slope(const StageSlopes& slopes, const double* lambda, double* to);
void take_step(const StageColumns& stage, const double* z, double* next);
double curvature(const Eigen::MatrixXd& H, const double* z, Eigen::VectorXd& work);

struct LqrPolicy {
  Eigen::MatrixXd K;  // (m x n)
  Eigen::VectorXd k;  // (m)
};

class Riccati {
 public:
  void begin(const Eigen::MatrixXd& H, const Eigen::VectorXd& g);
  bool push(const LqrStage& stage, double shift);
  // Like push, with a symmetric matrix of the size of stage.H added to it, or null.
  bool push(const StageColumns& stage, double shift, const Eigen::MatrixXd* added = nullptr);

  auto P() const { return P_.topRows(P_.cols()); }
  auto p() const { return p_.head(P_.cols()); }
  const LqrPolicy& policy() const { return policy_; }
  const Eigen::MatrixXd& input_curvature() const { return Q_uu_; }  // Q_uu + shift I of the stage that failed

 private:
  void resize(Eigen::Index n, Eigen::Index m);
  void add_cost_to_go(const StageColumns& stage, const Eigen::MatrixXd* added);
  bool take_input_curvature(Eigen::Index n, Eigen::Index m, double shift);
  bool factor();
  void eliminate(Eigen::Index n, Eigen::Index m);
  void take_cost_to_go(Eigen::Index n, Eigen::Index m);
  void find_minimum(Eigen::Index m);
  void find_gain(Eigen::Index n, Eigen::Index m);
  bool push_limited(const StageColumns& stage, double shift);
  void close(Eigen::Index n, Eigen::Index m, double shift);

  StageColumns stage_;
  LqrPolicy policy_;
  // Rows are padded (columns.h), except those of Q_uu and its factor.
  Eigen::MatrixXd P_, PF_, Q_, W_;  // PF_: transposed; W_: by rows
  Eigen::VectorXd p_, slope_, q_;
  // Q_uu = L L^T: -L below the diagonal, by columns and by rows; reciprocals of L's diagonal; - L^-1 q_u.
  Eigen::MatrixXd Q_uu_, L_, Lt_;
  Eigen::VectorXd inverse_, w_;
  Eigen::MatrixXd rest_;  // Q_ux + Q_uu K
};

// Minimises 1/2 u.H u + g.u within lower <= u <= upper; H positive definite.  `is_free`: entries inside their
// limits.  Starts from u = 0, clamped.
Eigen::VectorXd box_minimum(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const Eigen::VectorXd& lower,
                            const Eigen::VectorXd& upper, std::vector<bool>& is_free);

}  // namespace dyntape
