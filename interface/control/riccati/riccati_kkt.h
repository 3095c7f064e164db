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
//   Z = chain.solve_first(A, B);                       // the first stage's z alone, a and b being zero behind the second
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
// pivots, as collocation's may, that loses digits.  Those of a stage without rows of its own are put in always.
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
#include <cstdint>
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

  // Entries of the stages that are zero now are zero at every factorisation from here on; before, none is known to be.
  void take_structure();

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
  // (sides x variables of the first stage) z of many right sides, a row each, of the first two stages, zero behind them: as many rows
  // as columns.h pads to.
  Eigen::MatrixXd solve_first(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const;

 private:
  struct Entry {
    std::uint32_t row, column;
    double value;
  };
  // A stage's H, with the shift, and C as they were factored: columns where most entries may be other than zero, else those
  // entries alone, column by column.
  struct Matrices {
    bool are_columns = true;
    std::vector<Eigen::Index> touched;  // variables that the next link has; all
    std::vector<Entry> H, C;
    std::vector<std::size_t> C_begin;          // (touched + 1)
    Eigen::MatrixXd H_columns, C_columns, Ct;  // padded rows; Ct: of C, transposed

    void find(const Stage& s, bool all);
    void take(const Stage& s, double shift);
    void add_curvature(const double* z, double* to) const;    // to += H z
    void add_to_link(const double* z, double* to) const;      // to += C z
    void add_slope(const double* of_link, double* to) const;  // to += C^T of_link
    template <class Visit>                                    // visit(row, column, value)
    void each_of_H(const Visit& visit) const {
      each(H, H_columns, H_columns.cols(), visit);
    }
    template <class Visit>
    void each_of_C(const Visit& visit) const {
      each(C, C_columns, Ct.cols(), visit);
    }
    template <class Visit>
    void each(const std::vector<Entry>& entries, const Eigen::MatrixXd& columns, Eigen::Index rows,
              const Visit& visit) const {
      for (Eigen::Index j = 0; are_columns && j < columns.cols(); ++j) {
        for (Eigen::Index i = 0; i < rows; ++i) visit(i, j, columns(i, j));
      }
      for (std::size_t e = 0; !are_columns && e < entries.size(); ++e)
        visit(entries[e].row, entries[e].column, entries[e].value);
    }
  };
  struct Single {
    Eigen::Index link, variable;  // a link that says one variable of its stage
  };
  // What is left of a stage when its factorisation is done.  Variables are in the order of their pivots: those that single links say
  // (carried), other pivots (basic), free ones; rows likewise, and what is left of them.  `both` are free variables and what the link brings.
  struct Factor {
    std::vector<Single> singles;
    Matrices matrices;
    Eigen::Index carried = 0, rank = 0, free = 0;
    std::vector<Eigen::Index> row, col;
    Eigen::VectorXd pivots;  // (carried) minus one by them: by what the link brings
    Eigen::MatrixXd M;       // (n x rows but carried ones) rows as columns, then L^T and U^T
    Eigen::MatrixXd X;       // (both x basic) basic variables by both, transposed
    Eigen::MatrixXd L;       // (both x free) the factor of their cost
    Eigen::MatrixXd P, R;    // (links x links), (left x links) cost to go, and rows, of what the link brings
    // Of a solve: slopes by variables, by what the link brings, and what that is.
    Eigen::VectorXd slope, brought, z0, y, r0;
  };
  struct Sides {
    Eigen::MatrixXd slope, z0, y;  // of a stage, a row a right side
  };
  // Of the stage at hand.
  struct Work {
    std::vector<Eigen::Index>
        place;  // of a variable among both; before 0: of a basic one, counted from -1 on
    std::vector<double> weight, S, Y, B, W, PC, CP;
    Eigen::VectorXd sizes, own, z, slope, link, brought, t, multipliers;
  };

  void find_structure(bool all);
  void arrange(std::size_t k, double elastic);
  void eliminate_rows(Factor& f, Eigen::Index links);
  void solve_rows(Factor& f, Eigen::Index links);
  struct Assembly;
  Assembly begin_assembly(const Factor& f, Eigen::Index n, Eigen::Index both);
  void add_all(const Matrices& m, const Factor* next, const Assembly& to);
  void add_nonzeros(const Matrices& m, const Factor* next, const Assembly& to);
  void assemble(std::size_t k, double shift, double elastic);
  bool minimise(Factor& f, Eigen::Index links);
  void take_cost_to_go(Factor& f, Eigen::Index links);
  void sweep_back(std::size_t k, const Eigen::VectorXd& a, const Eigen::VectorXd& b, const Factor* next);
  void sweep_back(std::size_t k, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Sides* next,
                  Sides& to) const;
  void sweep_forward(std::size_t k, double* z);
  void take_multipliers(std::size_t k, const Eigen::VectorXd& a, double* lambda);
  void take_slope(std::size_t k, const Eigen::VectorXd& a, const double* z, const double* of_link,
                  double* to) const;

  std::vector<Stage> stages_;
  std::vector<Factor> factors_;
  std::vector<Eigen::Index> first_variable_, first_row_;
  static constexpr double kSpring =
      1e10;  // what rows without a variable of their own cost, squared and halved

  bool puts_in_links_;
  double inverse_elastic_ = 0;
  Work work_;
};

}  // namespace dyntape
