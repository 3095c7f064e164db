// SPDX-License-Identifier: BSD-3-Clause
//
// The linear systems of an interior-point method for a program whose variables form a chain of stages
// (NlpShape::stages).
//
//   StagewiseKkt kkt(shape);
//   kkt.set(jacobian, hessian);                          // non-zeros, of the patterns of the shape
//   if (!kkt.factor({.sigma_x = .., .sigma_s = .., .shift = 0})) ...    // wrong inertia
//   kkt.solve(right, step);
//
//   (W + sigma_x + shift) dx         + J^T dlambda       = right.x       (n)
//                sigma_s ds          -     dlambda       = right.s       (m), of inequalities
//   J dx       - ds (inequalities)   - elastic dlambda   = right.c       (m)
//
// Variables with equal bounds do not move; rows without bounds have no multiplier.  Slacks and inequalities are
// eliminated here, the rest is solved by RiccatiKkt.  Iterative refinement with the residual of the whole system
// corrects rounding.
//
// Errors.  ArgumentError: a row that couples stages that are not neighbours, or an inequality that couples two
// stages.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <dyntape/interface/control/nlp/nlp.h>
#include <dyntape/interface/control/riccati/riccati_kkt.h>

namespace dyntape {

enum class RowKind { kEquality, kInequality, kFree };

struct KktVector {
  Eigen::VectorXd x, s, c;  // (n), (m), (m); in a step c is dlambda
};

struct KktDiagonal {
  Eigen::VectorXd sigma_x, sigma_s;  // (n), (m) >= 0
  double shift = 0, elastic = 0;
  bool with_hessian = true;  // false: W = 0
};

class StagewiseKkt {
 public:
  explicit StagewiseKkt(const Nlp& nlp, bool puts_in_links = false);  // riccati_kkt.h

  RowKind kind(std::size_t row) const { return kind_[row]; }
  bool is_fixed(std::size_t variable) const { return place_[variable] < 0; }
  bool fits() const;  // true if the shape's bounds still match the structure of this system

  void set(const double* jacobian, const double* hessian);
  bool factor(const KktDiagonal& diagonal);
  // Refines until the residual is at most `good` of the right side, or does not decrease.
  void solve(const KktVector& right, KktVector& step, double good = 1e-12);
  // (variables of the first stage x held) d x / d x[held], for variables `held` that have equal bounds.
  Eigen::MatrixXd follow(const std::vector<std::size_t>& held);

  // y += J^T v and W v for the matrices of set().
  void add_transposed(const Eigen::VectorXd& v, Eigen::VectorXd& y) const;
  void add_hessian(const Eigen::VectorXd& v, Eigen::VectorXd& y) const;

 private:
  struct Entry {
    double* to;
    std::size_t from;
  };
  struct InequalityEntry {
    Eigen::Index column;  // of its stage
    std::size_t from;
  };
  struct InequalityRow {
    std::size_t row, stage;
    std::vector<InequalityEntry> entries;
  };

  void place_variables();
  void place_rows(const Nlp& nlp);
  void connect(bool puts_in_links);
  void add_both_products(const KktVector& v, KktVector& y) const;
  double largest_residual(const KktVector& right, const KktVector& step);
  void condensed_solve(const KktVector& right, KktVector& step);

  const NlpShape& shape_;
  std::vector<std::size_t> begin_, stage_of_;  // first variable of each stage; stage of each variable
  std::vector<Eigen::Index> place_,
      local_;  // index of each variable in the chain and in its stage; -1: fixed
  std::vector<RowKind> kind_;
  std::vector<std::size_t> row_stage_;   // of each row: its stage, or the stage of its link
  std::vector<Eigen::Index> row_place_;  // index of each equality in the chain
  std::vector<InequalityRow> inequalities_;
  std::vector<StageSizes> sizes_;
  std::optional<RiccatiKkt> chain_;
  std::vector<double*> jacobian_to_;  // destination of each non-zero in the chain, or null
  std::vector<double> nowhere_ = {0};
  std::vector<Entry> hessian_entries_;  // off the diagonal
  std::vector<Entry> diagonal_entries_,
      hessian_diagonal_;  // of each variable that is not fixed; of non-zeros there
  std::vector<std::size_t> fixed_, without_multiplier_;  // variables; rows

  Eigen::VectorXd J_, W_;  // non-zeros
  KktDiagonal diagonal_;
  Eigen::VectorXd a_, b_, z_, bound_multipliers_, row_sigma_;
  KktVector residual_, correction_;
};

}  // namespace dyntape
