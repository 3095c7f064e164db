// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/solvers/chain_kkt.h>

#include <cmath>
#include <numeric>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Pivots = std::vector<Eigen::Index>;

constexpr double kDependent = 1e-11;  // of the largest entry: what is left of a row that others make up
constexpr double kFlat = 1e-14;       // of its entry: what is left of a variable that has no curvature of its own

// P M Q = L U by complete pivoting, L and U in the place of M; the rank.
Eigen::Index eliminate_rows(MatrixXd& M, Pivots& row, Pivots& col) {
  const Eigen::Index rows = M.rows(), cols = M.cols(), most = std::min(rows, cols);
  row.resize(std::size_t(rows)), col.resize(std::size_t(cols));
  std::iota(row.begin(), row.end(), 0), std::iota(col.begin(), col.end(), 0);
  double least = 0;
  for (Eigen::Index step = 0; step < most; ++step) {
    Eigen::Index i = step, j = step;
    double pivot = 0;
    for (Eigen::Index c = step; c < cols; ++c) {
      const double* entries = &M.coeffRef(0, c);
      for (Eigen::Index r = step; r < rows; ++r) {
        const double size = std::abs(entries[r]);
        if (size > pivot) pivot = size, i = r, j = c;
      }
    }
    if (step == 0) least = kDependent * pivot;
    if (!(pivot > least)) return step;
    if (i != step) M.row(i).swap(M.row(step)), std::swap(row[std::size_t(i)], row[std::size_t(step)]);
    if (j != step) M.col(j).swap(M.col(step)), std::swap(col[std::size_t(j)], col[std::size_t(step)]);
    const Eigen::Index left = rows - step - 1;
    auto below = M.col(step).tail(left);
    below /= M(step, step);
    for (Eigen::Index c = step + 1; c < cols; ++c) {
      const double factor = M(step, c);
      if (factor != 0) M.col(c).tail(left) -= factor * below;
    }
  }
  return most;
}

// L L^T in the lower triangle of A; false unless it is positive definite by more than rounding.
bool cholesky(MatrixXd& A) {
  const Eigen::Index n = A.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    const double before = A(j, j), pivot = before - A.row(j).head(j).squaredNorm();
    if (!(pivot > kFlat * std::abs(before)) || !std::isfinite(pivot)) return false;
    A(j, j) = std::sqrt(pivot);
    const Eigen::Index left = n - j - 1;
    auto below = A.col(j).tail(left);
    if (j > 0) below.noalias() -= A.bottomLeftCorner(left, j).lazyProduct(A.row(j).head(j).transpose());
    below /= A(j, j);
  }
  return true;
}

}  // namespace

ChainKkt::ChainKkt(const std::vector<ChainSizes>& sizes)
    : stages_(sizes.size()), factors_(sizes.size()), first_variable_{0}, first_row_{0} {
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const Eigen::Index n = sizes[k].variables, links = sizes[k].links;
    const Eigen::Index next = k + 1 < sizes.size() ? sizes[k + 1].links : 0;
    stages_[k] = {MatrixXd::Zero(n, n), MatrixXd::Zero(sizes[k].rows, n), MatrixXd::Zero(next, n),
                  MatrixXd::Zero(links, n)};
    first_variable_.push_back(first_variable_.back() + n);
    first_row_.push_back(first_row_.back() + links + sizes[k].rows);
  }
}

// The cost of a stage with all behind it, and its rows with what they hand down.
void ChainKkt::assemble(std::size_t k, double shift, double elastic) {
  const Stage& s = stages_[k];
  Factor& f = factors_[k];
  const Eigen::Index n = s.H.rows(), links = s.D.rows(), own = links + s.G.rows();
  const Eigen::Index all = n + (elastic > 0 ? own : 0);
  Factor* const next = k + 1 < stages_.size() ? &factors_[k + 1] : nullptr;
  const Eigen::Index handed = next ? next->RC.rows() : 0;
  f.Q.resize(all, all);
  f.M.resize(own + handed, all);
  if (all > n) {
    f.Q.setZero();
    f.Q.diagonal().tail(own).setConstant(1 / elastic);
    f.M.rightCols(own).setZero();
    f.M.topRightCorner(own, own).setIdentity();
  }
  auto Q = f.Q.topLeftCorner(n, n);
  Q = s.H;
  Q.diagonal().array() += shift;
  auto M = f.M.leftCols(n);
  M.topRows(links) = s.D;
  M.middleRows(links, s.G.rows()) = s.G;
  if (!next) return;
  next->PC.noalias() = next->P * s.C;
  Q.noalias() += s.C.transpose() * next->PC;
  M.bottomRows(handed) = next->RC;
}

// False where what is free has no minimum.
bool ChainKkt::eliminate(std::size_t k) {
  Factor& f = factors_[k];
  const Eigen::Index links = stages_[k].D.rows(), rows = f.M.rows(), all = f.Q.rows();
  f.rank = eliminate_rows(f.M, f.row, f.col);
  const Eigen::Index rank = f.rank, free = all - rank, left = rows - rank;

  // Basic variables: - U11^-1 [ U12 | L11^-1 (rows that the link's are) ]; what is left of the others is R.
  f.X.setZero(rank, free + links);
  f.R.setZero(left, links);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index row = f.row[std::size_t(i)];
    if (row < links) (i < rank ? f.X(i, free + row) : f.R(i - rank, row)) = 1;
  }
  const auto L11 = f.M.topLeftCorner(rank, rank);
  auto by_free = f.X.leftCols(free), by_link = f.X.rightCols(links);
  L11.triangularView<Eigen::UnitLower>().solveInPlace(by_link);
  if (left > 0) f.R.noalias() -= f.M.bottomLeftCorner(left, rank) * by_link;
  by_free = f.M.topRightCorner(rank, free);
  L11.triangularView<Eigen::Upper>().solveInPlace(f.X);
  f.X = -f.X;

  // Q in the order of the pivots.
  f.QX.resize(all, all);
  for (Eigen::Index j = 0; j < all; ++j) {
    const double* from = &f.Q.coeffRef(0, f.col[std::size_t(j)]);
    double* to = &f.QX.coeffRef(0, j);
    for (Eigen::Index i = 0; i < all; ++i) to[i] = from[f.col[std::size_t(i)]];
  }
  f.Q.swap(f.QX);

  f.QX.noalias() = f.Q.leftCols(rank) * f.X;
  f.QX.leftCols(free) += f.Q.rightCols(free);
  f.L = f.QX.bottomLeftCorner(free, free);
  f.L.noalias() += by_free.transpose() * f.QX.topLeftCorner(rank, free);
  if (!cholesky(f.L)) return false;
  f.W = f.QX.bottomRightCorner(free, links);
  f.W.noalias() += by_free.transpose() * f.QX.topRightCorner(rank, links);
  f.L.triangularView<Eigen::Lower>().solveInPlace(f.W);
  f.P.noalias() = by_link.transpose() * f.QX.topRightCorner(rank, links);
  f.P.noalias() -= f.W.transpose() * f.W;
  return true;
}

bool ChainKkt::factor(double shift, double elastic) {
  elastic_ = elastic;
  for (std::size_t k = stages_.size(); k-- > 0;) {
    assemble(k, shift, elastic);
    if (!eliminate(k)) return false;
    if (k == 0) break;
    // Rows for the stage before, each with a largest entry of one; what it has no variable for either is left out.
    Factor& f = factors_[k];
    const MatrixXd& C = stages_[k - 1].C;
    f.RC.resize(f.R.rows(), C.cols());
    f.row_scale.resize(f.R.rows());
    if (f.R.rows() == 0) continue;
    f.RC.noalias() = f.R * C;
    const double least = C.size() > 0 ? kDependent * C.cwiseAbs().maxCoeff() : 0;
    for (Eigen::Index i = 0; i < f.RC.rows(); ++i) {
      const double size = C.cols() > 0 ? f.RC.row(i).cwiseAbs().maxCoeff() : 0;
      f.row_scale[i] = size > least ? 1 / size : 0;
      f.RC.row(i) *= f.row_scale[i];
    }
  }
  return true;
}

void ChainKkt::solve(const VectorXd& a, const VectorXd& b, VectorXd& z, VectorXd& lambda) {
  z.resize(variables()), lambda.resize(rows());
  for (std::size_t k = stages_.size(); k-- > 0;) {
    Factor& f = factors_[k];
    Factor* const next = k + 1 < stages_.size() ? &factors_[k + 1] : nullptr;
    const Eigen::Index n = stages_[k].H.rows(), own = stages_[k].D.rows() + stages_[k].G.rows();
    const Eigen::Index rows = f.M.rows(), all = f.Q.rows(), rank = f.rank, free = all - rank;
    // q and the constants of the rows, by pivots.
    f.t.setZero(all);
    f.t.head(n) = -a.segment(first_variable_[k], n);
    if (next) f.t.head(n).noalias() += stages_[k].C.transpose() * next->p;
    f.q.resize(all);
    for (Eigen::Index i = 0; i < all; ++i) f.q[i] = f.t[f.col[std::size_t(i)]];
    f.w.resize(rows);
    f.w.head(own) = -b.segment(first_row_[k], own);
    if (next) f.w.tail(rows - own) = next->row_scale.cwiseProduct(next->r0);
    f.s.resize(rows);
    for (Eigen::Index i = 0; i < rows; ++i) f.s[i] = f.w[f.row[std::size_t(i)]];

    const auto L11 = f.M.topLeftCorner(rank, rank);
    f.z0 = f.s.head(rank);
    L11.triangularView<Eigen::UnitLower>().solveInPlace(f.z0);
    f.r0 = f.s.tail(rows - rank);
    if (rows > rank) f.r0.noalias() -= f.M.bottomLeftCorner(rows - rank, rank) * f.z0;
    L11.triangularView<Eigen::Upper>().solveInPlace(f.z0);
    f.z0 = -f.z0;
    f.t = f.q;
    f.t.noalias() += f.Q.leftCols(rank) * f.z0;
    f.w = f.t.tail(free);
    f.w.noalias() += f.X.leftCols(free).transpose() * f.t.head(rank);
    f.L.triangularView<Eigen::Lower>().solveInPlace(f.w);
    f.p.noalias() = f.X.rightCols(f.W.cols()).transpose() * f.t.head(rank);
    f.p.noalias() -= f.W.transpose() * f.w;
  }
  for (std::size_t k = 0; k < stages_.size(); ++k) {
    Factor& f = factors_[k];
    const Eigen::Index n = stages_[k].H.rows(), links = stages_[k].D.rows(),
                       own = links + stages_[k].G.rows();
    const Eigen::Index rows = f.M.rows(), all = f.Q.rows(), rank = f.rank, free = all - rank;
    Factor* const next = k + 1 < stages_.size() ? &factors_[k + 1] : nullptr;
    f.t.resize(all);
    if (k > 0) {
      f.s.noalias() = stages_[k - 1].C * z.segment(first_variable_[k - 1], stages_[k - 1].H.rows());
      f.w.noalias() += f.W * f.s;
      f.z0.noalias() += f.X.rightCols(links) * f.s;
    }
    f.L.triangularView<Eigen::Lower>().transpose().solveInPlace(f.w);
    f.t.tail(free) = -f.w;
    f.t.head(rank) = f.z0;
    f.t.head(rank).noalias() += f.X.leftCols(free) * f.t.tail(free);
    for (Eigen::Index i = 0; i < all; ++i) {
      const Eigen::Index variable = f.col[std::size_t(i)];
      if (variable < n) z[first_variable_[k] + variable] = f.t[i];
    }
    // Prices of the rows, by what they hold against.
    const auto L11 = f.M.topLeftCorner(rank, rank);
    f.lambda.setZero(rows);
    f.lambda.head(rank) = -f.q.head(rank);
    f.lambda.head(rank).noalias() -= f.Q.topRows(rank) * f.t;
    L11.triangularView<Eigen::Upper>().transpose().solveInPlace(f.lambda.head(rank));
    if (k > 0 && rows > rank) {
      f.lambda.tail(rows - rank) = factors_[k].r0;  // by the stage before, below
      f.lambda.head(rank).noalias() -=
          f.M.bottomLeftCorner(rows - rank, rank).transpose() * f.lambda.tail(rows - rank);
    }
    L11.triangularView<Eigen::UnitLower>().transpose().solveInPlace(f.lambda.head(rank));
    f.s.resize(rows);
    for (Eigen::Index i = 0; i < rows; ++i) f.s[f.row[std::size_t(i)]] = f.lambda[i];
    lambda.segment(first_row_[k], own) = f.s.head(own);
    if (next) next->r0 = next->row_scale.cwiseProduct(f.s.tail(rows - own));
  }
}

}  // namespace dyntape
