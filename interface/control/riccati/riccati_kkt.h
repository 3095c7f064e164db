// SPDX-License-Identifier: BSD-3-Clause
//
// Quadratic problems whose variables stand in a chain of stages, each tied to its neighbours alone, in time linear in
// their number.
//
//   minimise    sum_k  1/2 z_k.H_k z_k - a_k.z_k
//   subject to  C_{k-1} z_{k-1} + D_k z_k = b_k        links, k = 1 .. N
//               G_k z_k = e_k                          rows of one stage, k = 0 .. N
//
//   RiccatiKkt chain(sizes);
//   chain.stage(k).H = ...                             // and G, C, D; kept by factor()
//   if (!chain.factor(shift)) ...                      // H + shift I is not convex on what the rows leave free
//   chain.solve(a, b, z, lambda);                      // H z + M^T lambda = a,  M z = b, M all rows
//   chain.solve_first(a, b, z);                        // the first stage's z alone, a and b being zero behind the second
//
// Vectors are those of the stages one after another; rows are, stage by stage, those of its link, then its own.
//
// Method.  From the last stage to the first: rows that tie a stage are solved for as many of its variables as they have rank
// (elimination with pivoting), what is free then is minimised (Cholesky), and what is left is a quadratic cost to go
// of C_{k-1} z_{k-1} alone.  Rows that a stage has no variable for become costs of the stages before: stiff springs.  With links
// x_k = A x_{k-1} + B u_{k-1} this is Riccati's recursion, and it is as long; with links of collocation it is the same
// recursion with their implicit state solved for.  Every Cholesky factorisation goes through if and only if the problem is
// strictly convex on its rows: the whole system has the right inertia.
//
// puts_in_links: links that say one variable each by the stage before, as of steps forward in time, are put in before a stage's own
// rows choose their pivots: a stage of 79 variables whose 37 states are such takes a third.  Where own rows need these variables as
// pivots, as collocation's may, that loses digits.
//
// Springs, and no rows handed down: a goal met by the last few controls alone takes controls that grow with a power of 1/h, and
// their squares leave no digit of the cost to go; springs let all stages share.  A solution then misses such rows by their multipliers over
// the spring's 1e10; solving again for what is missing makes that as small as rounding (stage_kkt.h).  Rows of the first stage
// that depend on others are left out: lambda is 0 there, and the result misses b by what they contradict the others by.
//
// elastic > 0 softens all rows: M z - elastic lambda = b.  Nothing depends then; for finding feasible points.
//
// Sources: J. Rawlings, D. Mayne, M. Diehl, Model Predictive Control, 2017, 8.8; L. Vanroye, A. Sathya, J. De Schutter,
// W. Decre, FATROP: a fast constrained optimal control problem solver for robot trajectory optimization and control, IROS 2023.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include <dyntape/autodiff/eigen_layout.h>

namespace dyntape {

struct StageSizes {
  int variables, rows, links;  // of a stage; links: rows that tie it to the stage before, 0 for the first
};

class RiccatiKkt {
 public:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct Stage {
    Eigen::MatrixXd H, C;  // (n x n) symmetric, both triangles; (links of the next x n)
    Rows G, D;             // (rows x n), (links x n)
  };

  explicit RiccatiKkt(const std::vector<StageSizes>& sizes, bool puts_in_links = false);

  std::size_t stages() const { return stages_.size(); }
  Stage& stage(std::size_t k) { return stages_[k]; }
  Eigen::Index variables() const { return first_variable_.back(); }
  Eigen::Index rows() const { return first_row_.back(); }
  // Where the entries of stage k begin; k = stages(): their number.
  Eigen::Index first_variable(std::size_t k) const { return first_variable_[k]; }
  Eigen::Index first_row(std::size_t k) const { return first_row_[k]; }
  Eigen::Index variables_before(std::size_t k) const { return first_variable_[std::min(k, stages())]; }
  Eigen::Index rows_before(std::size_t k) const { return first_row_[std::min(k, stages())]; }

  bool factor(double shift, double elastic = 0);
  void solve(const Eigen::VectorXd& a, const Eigen::VectorXd& b, Eigen::VectorXd& z, Eigen::VectorXd& lambda);
  // z of the first stage alone, where a and b are zero behind the second.
  void solve_first(const Eigen::VectorXd& a, const Eigen::VectorXd& b, Eigen::VectorXd& z);

 private:
  struct NonZero {
    Eigen::Index row;
    double value;
  };
  // What is left of a stage when its factorisation is done.  Variables and rows are in the order of their pivots, basic ones
  // first; `both` are free variables and what the link brings.
  struct Factor {
    Eigen::Index rank = 0, free = 0, carried = 0;  // carried: basic by links of one variable each, the first
    std::vector<Eigen::Index> row, col;            // pivots
    Eigen::MatrixXd Q, ordered;                    // (n x n) cost of the stage and all behind it; room for it
    Eigen::MatrixXd M;                             // (n x rows) rows as columns: own, links; then L^T and U^T
    Eigen::MatrixXd X;                             // (both x rank) basic variables by both, transposed
    Eigen::MatrixXd V, S;    // (both x n), (both x both) cost by both; S: its factor, then the cost to go
    Eigen::MatrixXd P, R;    // (links x links), (left x links) cost to go, and rows, of what the link brings
    Eigen::MatrixXd PC, CP;  // P by the variables of the stage before; its transpose
    std::vector<NonZero> C;  // of the link to the next stage, column by column
    std::vector<std::size_t> C_begin;  // (n + 1)
    Eigen::VectorXd q, s, z0, t, y, r0, lambda;
  };

  void assemble(std::size_t k, double shift, double elastic);
  static void order_rows(Factor& f, const Stage& s, bool puts_in);
  static void order_variables(Factor& f);
  void eliminate_rows(Factor& f, Eigen::Index links);
  static bool minimise(Factor& f, Eigen::Index links);
  bool eliminate(std::size_t k);
  void hand_down(std::size_t k);
  void sweep_back(std::size_t k, const Eigen::VectorXd& a, const Eigen::VectorXd& b, const double* slope);
  void sweep_forward(std::size_t k, double* z);
  void take_multipliers(std::size_t k, double* lambda);

  std::vector<Stage> stages_;
  std::vector<Factor> factors_;
  std::vector<Eigen::Index> first_variable_, first_row_;
  bool puts_in_links_;
};

}  // namespace dyntape
