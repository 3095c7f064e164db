// SPDX-License-Identifier: BSD-3-Clause
//
// Solves with the factors of riccati_kkt.cpp.
#include <dyntape/interface/control/riccati/columns.h>
#include <dyntape/interface/control/riccati/riccati_kkt.h>

namespace dyntape {

using namespace columns;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// to += A x, columns of padded length.
void add_padded(double* to, const MatrixXd& A, const double* x) {
  add_product(to, A.rows(), A.data(), A.rows(), x, A.cols(), A.rows(), A.cols(), 1);
}

Index block_of(Index i) { return i / kPad * kPad; }

}  // namespace

void RiccatiKkt::Matrices::add_curvature(const double* z, double* to) const {
  if (are_columns) return add_padded(to, H_columns, z);
  for (const Entry& e : H) to[e.row] += e.value * z[e.column];
}

void RiccatiKkt::Matrices::add_to_link(const double* z, double* to) const {
  if (are_columns) return add_padded(to, C_columns, z);
  for (const Entry& e : C) to[e.row] += e.value * z[e.column];
}

void RiccatiKkt::Matrices::add_slope(const double* of_link, double* to) const {
  if (are_columns) return add_padded(to, Ct, of_link);
  for (const Entry& e : C) to[e.column] += e.value * of_link[e.row];
}

// to: the cost-to-go gradient of a stage, at z and its values for the next link; of_link: gradient of the next
// stage's cost-to-go.
void RiccatiKkt::take_slope(std::size_t k, const VectorXd& a, const double* z, const double* of_link,
                            double* to) const {
  const Index n = stages_[k].H.cols(), all = Index(factors_[k].col.size());
  const Matrices& m = factors_[k].matrices;
  for (Index i = 0; i < n; ++i) to[i] = -a[first_variable_[k] + i];
  std::fill(to + n, to + padded(all), 0.0);
  m.add_curvature(z, to);
  if (of_link) m.add_slope(of_link, to);
  for (Index i = n; i < all; ++i) to[i] = inverse_elastic_ * z[i];
}

// Backward substitution for a stage: z0, r0, y and the cost-to-go gradient with respect to the link's values.
// `next`: the next stage, if its gradient is nonzero.
void RiccatiKkt::sweep_back(std::size_t k, const VectorXd& a, const VectorXd& b, const Factor* next) {
  Factor& f = factors_[k];
  const Index links = stages_[k].D.rows(), of_M = f.M.rows(), all = Index(f.col.size());
  const Index carried = f.carried, rank = f.rank, free = f.free, basic = rank - carried, pad = f.X.rows();
  const double* const M = f.M.data();
  // Constants of the rows, then their contributions to basic variables.
  VectorXd& s = work_.t;
  s.setZero(padded(rank)), f.z0.setZero(padded(rank)), f.r0.resize(f.M.cols() - basic);
  const double* const of_b = b.data() + first_row_[k];
  for (Index i = 0; i < carried; ++i) s[i] = -of_b[f.row[std::size_t(i)]];
  for (Index c = 0; c < f.M.cols(); ++c) {
    const Index i = carried + c;
    const double of_row =
        -of_b[f.row[std::size_t(i)]] - padded_dot(M + c * of_M, s.data(), padded(std::min(i, rank)));
    (c < basic ? s[i] : f.r0[c - basic]) = of_row;
  }
  for (Index c = basic; c-- > 0;) {
    const Index i = carried + c, behind = block_of(i + 1);
    const double* const of_U = M + c * of_M;
    f.z0[i] = -(s[i] + padded_dot(of_U + behind, f.z0.data() + behind, s.size() - behind)) / of_U[i];
  }
  for (Index i = 0; i < carried; ++i) f.z0[i] = f.pivots[i] * s[i];

  VectorXd &z = work_.z, &slope = work_.slope, &of_link = work_.link, &brought = work_.brought;
  z.setZero(padded(all)), slope.resize(padded(all));
  for (Index i = 0; i < rank; ++i) z[f.col[std::size_t(i)]] = f.z0[i];
  if (k + 1 < stages()) {
    const Factor& behind = factors_[k + 1];
    brought.setZero(behind.P.rows());
    f.matrices.add_to_link(z.data(), brought.data());
    if (next)
      of_link = next->slope;
    else
      of_link.setZero(behind.P.rows());
    add_padded(of_link.data(), behind.P, brought.data());
  }
  take_slope(k, a, z.data(), k + 1 < stages() ? of_link.data() : nullptr, slope.data());

  // Of free variables and the link's values.
  f.y.setZero(pad);
  for (Index i = 0; i < free; ++i) f.y[i] = slope[f.col[std::size_t(rank + i)]];
  for (Index i = 0; i < carried; ++i)
    f.y[free + f.row[std::size_t(i)]] = f.pivots[i] * slope[f.col[std::size_t(i)]];
  s.resize(padded(rank));
  for (Index i = 0; i < basic; ++i) s[i] = slope[f.col[std::size_t(carried + i)]];
  add_padded(f.y.data(), f.X, s.data());
  for (Index j = 0; j < free; ++j) {
    const Index first = block_of(j);
    const double* const column = f.L.data() + j * pad;
    const double y = f.y[j] / column[j];
    add(f.y.data() + first, -y, column + first, pad - first);
    f.y[j] = y;
  }
  f.slope.setZero(padded(links));
  for (Index i = 0; i < links; ++i) f.slope[i] = f.y[free + i];
  for (Index r = 0; r < f.r0.size(); ++r) {
    for (Index c = 0; c < links; ++c) f.slope[c] += kSpring * f.R(r, c) * f.r0[r];
  }
}

// A stage's variables for given values of its link: into work_.z and its entries of z.
void RiccatiKkt::sweep_forward(std::size_t k, double* z) {
  Factor& f = factors_[k];
  const Index links = stages_[k].D.rows(), n = stages_[k].H.cols(), all = Index(f.col.size());
  const Index carried = f.carried, rank = f.rank, free = f.free, pad = f.X.rows();
  VectorXd &both = work_.t, &own = work_.z;
  both.setZero(pad), own.setZero(padded(all));
  if (k > 0) both.segment(free, links) = f.brought.head(links);
  for (Index j = free; j-- > 0;) {
    const Index first = block_of(j);
    const double* const column = f.L.data() + j * pad;
    both[j] = -(f.y[j] + padded_dot(column + first, both.data() + first, pad - first)) / column[j];
    own[f.col[std::size_t(rank + j)]] = both[j];
  }
  for (Index i = 0; i < carried; ++i)
    own[f.col[std::size_t(i)]] = f.z0[i] + f.pivots[i] * both[free + f.row[std::size_t(i)]];
  for (Index i = carried; i < rank; ++i)
    own[f.col[std::size_t(i)]] = f.z0[i] + padded_dot(f.X.data() + (i - carried) * pad, both.data(), pad);
  std::copy(own.data(), own.data() + n, z + first_variable_[k]);
}

// Multipliers of a stage's rows; those of the next link, if it has no other rows, are the gradients of its
// cost-to-go.
void RiccatiKkt::take_multipliers(std::size_t k, const VectorXd& a, double* lambda) {
  Factor& f = factors_[k];
  VectorXd &slope = work_.slope, &of_link = work_.link;
  const bool is_last = k + 1 == stages();
  if (!is_last) {
    Factor& next = factors_[k + 1];
    next.brought.setZero(next.P.rows());
    f.matrices.add_to_link(work_.z.data(), next.brought.data());
    of_link = next.slope;
    add_padded(of_link.data(), next.P, next.brought.data());
    if (next.M.cols() == 0)
      std::copy(of_link.data(), of_link.data() + next.P.cols(), lambda + first_row_[k + 1]);
  }
  const Index links = stages_[k].D.rows(), of_M = f.M.rows(), rows = Index(f.row.size());
  const Index carried = f.carried, rank = f.rank, basic = rank - carried;
  if (f.M.cols() == 0) return;
  slope.resize(padded(Index(f.col.size())));
  take_slope(k, a, work_.z.data(), is_last ? nullptr : of_link.data(), slope.data());
  VectorXd& multipliers = work_.multipliers;
  multipliers.setZero(rows);
  double* const multiplier = multipliers.data();
  for (Index i = 0; i < rank; ++i) multiplier[i] = -slope[f.col[std::size_t(i)]];
  for (Index i = 0; i < carried; ++i) multiplier[i] *= -f.pivots[i];
  for (Index c = 0; c < basic; ++c) {
    const Index i = carried + c;
    const double* const of_U = f.M.data() + c * of_M + i;
    multiplier[i] /= of_U[0];
    add(multiplier + i + 1, -multiplier[i], of_U + 1, rank - i - 1);
  }
  for (Index i = rank; k > 0 && i < rows; ++i) {
    double missed = f.r0[i - rank];
    for (Index c = 0; c < links; ++c) missed += f.R(i - rank, c) * f.brought[c];
    multiplier[i] = kSpring * missed;
    add(multiplier, -multiplier[i], f.M.data() + (i - carried) * of_M, rank);
  }
  for (Index c = basic; c-- > 0;)
    add(multiplier, -multiplier[carried + c], f.M.data() + c * of_M, carried + c);
  for (Index i = 0; i < rows; ++i) lambda[first_row_[k] + f.row[std::size_t(i)]] = multiplier[i];
}

void RiccatiKkt::solve(const VectorXd& a, const VectorXd& b, VectorXd& z, VectorXd& lambda) {
  z.resize(variables()), lambda.resize(rows());
  for (std::size_t k = stages(); k-- > 0;) sweep_back(k, a, b, k + 1 < stages() ? &factors_[k + 1] : nullptr);
  for (std::size_t k = 0; k < stages(); ++k) {
    sweep_forward(k, z.data());
    take_multipliers(k, a, lambda.data());
  }
}

// Like sweep_back, for many right sides, one row each.
void RiccatiKkt::sweep_back(std::size_t k, const MatrixXd& a, const MatrixXd& b, const Sides* next,
                            Sides& to) const {
  const Factor& f = factors_[k];
  const Matrices& m = f.matrices;
  const Index lanes = a.rows(), n = stages_[k].H.cols(), links = stages_[k].D.rows();
  const Index of_M = f.M.rows(), all = Index(f.col.size());
  const Index carried = f.carried, rank = f.rank, free = f.free, basic = rank - carried;
  MatrixXd s(lanes, rank), r0(lanes, f.M.cols() - basic);
  VectorXd sum;
  const auto of_b = [&](Index i) { return b.col(first_row_[k] + f.row[std::size_t(i)]); };
  for (Index i = 0; i < carried; ++i) s.col(i) = -of_b(i);
  for (Index c = 0; c < f.M.cols(); ++c) {
    sum = of_b(carried + c);
    add_columns(sum.data(), s.data(), lanes, f.M.data() + c * of_M, std::min(carried + c, rank), lanes);
    (c < basic ? s.col(carried + c) : r0.col(c - basic)) = -sum;
  }
  to.z0.resize(lanes, rank);
  for (Index c = basic; c-- > 0;) {
    const Index i = carried + c;
    const double* const of_U = f.M.data() + c * of_M;
    sum = s.col(i);
    add_columns(sum.data(), to.z0.data() + (i + 1) * lanes, lanes, of_U + i + 1, rank - i - 1, lanes);
    to.z0.col(i) = sum / -of_U[i];
  }
  for (Index i = 0; i < carried; ++i) to.z0.col(i) = f.pivots[i] * s.col(i);

  MatrixXd z = MatrixXd::Zero(lanes, all), slope = z;
  for (Index i = 0; i < rank; ++i) z.col(f.col[std::size_t(i)]) = to.z0.col(i);
  slope.leftCols(n) = -a.middleCols(first_variable_[k], n);
  const auto add_to = [&](MatrixXd& sums, Index i, double value, const MatrixXd& of, Index j) {
    add(sums.data() + i * lanes, value, of.data() + j * lanes, lanes);
  };
  m.each_of_H([&](Index i, Index j, double value) { add_to(slope, i, value, z, j); });
  if (k + 1 < stages()) {
    const MatrixXd& P = factors_[k + 1].P;
    MatrixXd brought = MatrixXd::Zero(lanes, P.cols()), of_link = next ? next->slope : brought;
    m.each_of_C([&](Index i, Index j, double value) { add_to(brought, i, value, z, j); });
    add_product(of_link.data(), lanes, brought.data(), lanes, P.data(), P.rows(), lanes, P.cols(), P.cols());
    m.each_of_C([&](Index i, Index j, double value) { add_to(slope, j, value, of_link, i); });
  }
  for (Index i = n; i < all; ++i) slope.col(i) = inverse_elastic_ * z.col(i);

  MatrixXd& y = to.y;
  y.setZero(lanes, free + links), s.resize(lanes, basic);
  for (Index i = 0; i < free; ++i) y.col(i) = slope.col(f.col[std::size_t(rank + i)]);
  for (Index i = 0; i < carried; ++i)
    y.col(free + f.row[std::size_t(i)]) = f.pivots[i] * slope.col(f.col[std::size_t(i)]);
  for (Index c = 0; c < basic; ++c) s.col(c) = slope.col(f.col[std::size_t(carried + c)]);
  add_product<Factors::kRows>(y.data(), lanes, s.data(), lanes, f.X.data(), f.X.rows(), lanes, basic,
                              free + links);
  for (Index j = 0; j < free; ++j) {
    y.col(j) /= f.L(j, j);
    for (Index i = j + 1; i < free + links; ++i) add_to(y, i, -f.L(i, j), y, j);
  }
  to.slope = y.rightCols(links);
  for (Index r = 0; r < r0.cols(); ++r) {
    for (Index c = 0; c < links; ++c) add_to(to.slope, c, kSpring * f.R(r, c), r0, r);
  }
}

MatrixXd RiccatiKkt::solve_first(const MatrixXd& a, const MatrixXd& b) const {
  const Index lanes = a.rows();
  Sides first, second;
  if (stages() > 1) sweep_back(1, a, b, nullptr, second);
  sweep_back(0, a, b, stages() > 1 ? &second : nullptr, first);
  const Factor& f = factors_[0];
  MatrixXd both(lanes, f.free), z = MatrixXd::Zero(lanes, first_variable_[1]);
  const auto take = [&](Index pivot, const VectorXd& value) {
    if (f.col[std::size_t(pivot)] < z.cols()) z.col(f.col[std::size_t(pivot)]) = value;
  };
  VectorXd sum;
  for (Index j = f.free; j-- > 0;) {
    sum = first.y.col(j);
    add_columns(sum.data(), both.data() + (j + 1) * lanes, lanes, &f.L(j, j) + 1, f.free - j - 1, lanes);
    both.col(j) = sum / -f.L(j, j);
    take(f.rank + j, both.col(j));
  }
  for (Index i = 0; i < f.rank; ++i) {
    sum = first.z0.col(i);
    if (i >= f.carried)
      add_columns(sum.data(), both.data(), lanes, f.X.data() + (i - f.carried) * f.X.rows(), f.free, lanes);
    take(i, sum);
  }
  return z;
}

}  // namespace dyntape
