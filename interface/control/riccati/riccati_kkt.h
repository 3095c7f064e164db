// SPDX-License-Identifier: BSD-3-Clause
//
// Solves quadratic problems whose variables form a chain of stages, each coupled to its neighbours only, in time
// linear in the number of stages.
//
//   minimise    sum_k  1/2 z_k.H_k z_k - a_k.z_k
//   subject to  C_{k-1} z_{k-1} + D_k z_k = b_k        links, k = 1 .. N
//               G_k z_k = e_k                          rows of one stage, k = 0 .. N
//
//   RiccatiKkt chain(sizes);
//   chain.stage(k).H = ...                             // and G, C, D; kept by factor()
//   if (!chain.factor(shift)) ...                      // H + shift I is not convex in the null space of the rows
//   chain.solve(a, b, z, lambda);                      // H z + M^T lambda = a,  M z = b, M all rows
//   Z = chain.solve_first(A, B);                       // the first stage's z; a and b are zero after stage 1
//
// Vectors are concatenated by stage; rows are, stage by stage, those of the link, then the stage's own.
//
// Method.  From the last stage to the first: rows of a stage are solved for as many of its variables as they have
// rank (elimination with pivoting), the free variables are minimised (Cholesky), and the rest is a quadratic
// cost-to-go of C_{k-1} z_{k-1} alone.  Rows without a variable in their stage become costs of the earlier stages:
// stiff springs.  With links x_k = A x_{k-1} + B u_{k-1} this is the Riccati recursion, with the same cost.  With
// links of collocation it is the same recursion with the implicit state solved for.  Every Cholesky factorisation
// succeeds if and only if the problem is strictly convex on its rows, i.e. the whole system has the right inertia.
//
// puts_in_links: links that determine one variable each from the previous stage (explicit integration steps) are
// substituted before a stage's own rows choose their pivots.  A stage of 79 variables with 37 such states takes a
// third of the time.  If own rows need these variables as pivots, e.g. in collocation, this loses digits.  In stages
// without own rows such links are always substituted.
//
// Springs.  Rows are not passed to earlier stages: controls that satisfy a goal in the last few steps grow with a
// power of 1/h, and their squares leave no digit of the cost-to-go.  With springs all stages contribute.  The
// solution violates such rows by their multipliers over the spring's 1e10; solving again for the residual reduces
// this to rounding (stage_kkt.h).  Dependent rows of the first stage are dropped: their lambda is 0, and the
// residual is their contradiction.
//
// elastic > 0 softens all rows: M z - elastic lambda = b.  Then no rows are dependent; used to find feasible points.
//
// Sources: J. Rawlings, D. Mayne, M. Diehl, Model Predictive Control, 2017, 8.8; L. Vanroye, A. Sathya, J. De Schutter,
// W. Decre, FATROP: a fast constrained optimal control problem solver for robot trajectory optimization and control,
// IROS 2023.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include <dyntape/autodiff/eigen_layout.h>

namespace dyntape {

struct StageSizes {
  int variables, rows,
      links;  // of a stage; links: rows that couple it to the previous stage, 0 for the first
};

class RiccatiKkt {
 public:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct Stage {
    Eigen::MatrixXd H, C;  // (n x n) symmetric, both triangles; (links of the next x n)
    Rows G, D;             // (rows x n), (links x n)
  };

  explicit RiccatiKkt(const std::vector<StageSizes>& sizes, bool puts_in_links = false);

  // Entries of the stages that are zero now are zero in all later factorisations.  Without this call none is known
  // to be zero.
  void take_structure();

  std::size_t stages() const { return stages_.size(); }
  Stage& stage(std::size_t k) { return stages_[k]; }
  Eigen::Index variables() const { return first_variable_.back(); }
  Eigen::Index rows() const { return first_row_.back(); }
  // First index of stage k; k = stages(): their number.
  Eigen::Index first_variable(std::size_t k) const { return first_variable_[k]; }
  Eigen::Index first_row(std::size_t k) const { return first_row_[k]; }
  Eigen::Index variables_before(std::size_t k) const { return first_variable_[std::min(k, stages())]; }
  Eigen::Index rows_before(std::size_t k) const { return first_row_[std::min(k, stages())]; }

  bool factor(double shift, double elastic = 0);
  void solve(const Eigen::VectorXd& a, const Eigen::VectorXd& b, Eigen::VectorXd& z, Eigen::VectorXd& lambda);
  // (sides x variables of the first stage) z for many right sides, one per row, given for the first two stages and
  // zero after them; the number of rows is padded as in columns.h.
  Eigen::MatrixXd solve_first(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const;

 private:
  struct Entry {
    std::uint32_t row, column;
    double value;
  };
  // A stage's H, with the shift, and C as factored: dense columns if most entries may be nonzero, else the nonzero
  // entries, column by column.
  struct Matrices {
    bool are_columns = true;
    std::vector<Eigen::Index> touched;  // variables in the next link
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
    Eigen::Index link, variable;  // a link that determines one variable of its stage
  };
  // Result of a stage's factorisation.  Variables are in the order of their pivots: substituted by single links
  // (carried), other pivots (basic), free ones; rows likewise, then the remaining rows.  `both`: free variables and
  // the link's values.
  struct Factor {
    std::vector<Single> singles;
    Matrices matrices;
    Eigen::Index carried = 0, rank = 0, free = 0;
    std::vector<Eigen::Index> row, col;
    Eigen::VectorXd pivots;  // (carried) minus one over the pivots: by the link's values
    Eigen::MatrixXd M;       // (n x rows except carried ones) rows as columns, then L^T and U^T
    Eigen::MatrixXd X;       // (both x basic) basic variables as functions of both, transposed
    Eigen::MatrixXd L;       // (both x free) the factor of their cost
    Eigen::MatrixXd P,
        R;  // (links x links), (left x links) cost-to-go, and rows, as functions of the link's values
    // Of a solve: gradients with respect to variables and to the link's values, and these values.
    Eigen::VectorXd slope, brought, z0, y, r0;
  };
  struct Sides {
    Eigen::MatrixXd slope, z0, y;  // of a stage, one row per right side
  };
  // Of the current stage.
  struct Work {
    std::vector<Eigen::Index>
        place;  // index of a variable among both; negative: a basic one, counted from -1
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
      1e10;  // stiffness of rows without their own variable: squared violation, times half of this

  bool puts_in_links_;
  double inverse_elastic_ = 0;
  Work work_;
};

}  // namespace dyntape
