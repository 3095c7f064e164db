// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/riccati.h>

#include <cmath>

#include <dyntape/interface/control/riccati/columns.h>

namespace dyntape {

using namespace columns;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

bool is_within(const VectorXd& u, const VectorXd& lower, const VectorXd& upper) {
  return (u.array() >= lower.array()).all() && (u.array() <= upper.array()).all();
}

}  // namespace

StageColumns::StageColumns(Index of_x, Index of_u)
    : StageSlopes{MatrixXd::Zero(padded(of_x + of_u), of_x), VectorXd::Zero(padded(of_x + of_u))},
      n(of_x),
      m(of_u),
      H(MatrixXd::Zero(padded(of_x + of_u), of_x + of_u)),
      c(VectorXd::Zero(of_x)) {}

StageColumns::StageColumns(const LqrStage& s) : StageColumns(s.A.cols(), s.B.cols()) {
  Ft.topRows(n) = s.A.transpose(), Ft.middleRows(n, m) = s.B.transpose();
  H.topRows(n + m) = s.H.selfadjointView<Eigen::Lower>();
  g.head(n + m) = s.g, c = s.c;
  lower = s.lower, upper = s.upper;
}

void add_slope(const StageSlopes& s, const double* lambda, double* to) {
  add_columns(to, s.Ft.data(), s.Ft.rows(), lambda, s.Ft.cols(), s.Ft.rows());
}

void take_step(const StageColumns& s, const double* z, double* next) {
  const Index of_z = s.Ft.rows();
  for (Index i = 0; i < s.n; ++i) next[i] = s.c[i] + padded_dot(s.Ft.data() + i * of_z, z, of_z);
}

double curvature(const MatrixXd& H, const double* z, VectorXd& work) {
  work.setZero(H.rows());
  add_columns(work.data(), H.data(), H.rows(), z, H.cols(), H.rows());
  return padded_dot(work.data(), z, H.rows());
}

void Riccati::begin(const MatrixXd& H, const VectorXd& g) {
  P_.setZero(padded(H.rows()), H.cols()), p_.setZero(P_.rows());
  P_.topRows(H.rows()) = H, p_.head(g.size()) = g;
}

// What is behind the rows stays zero.
void Riccati::resize(Index n, Index m) {
  const Index of_x = padded(n), of_z = padded(n + m);
  if (Q_.rows() == of_z && Q_.cols() == n + m && W_.rows() == of_x && W_.cols() == m) return;
  Q_.setZero(of_z, n + m), q_.setZero(of_z);
  slope_.setZero(of_x), W_.setZero(of_x, m), w_.setZero(m), inverse_.setZero(m);
  Q_uu_.setZero(m, m), L_.setZero(m, m), Lt_.setZero(m, m);
}

// Q and q: the lower triangle.
void Riccati::add_cost_to_go(const StageColumns& s, const MatrixXd* added) {
  const Index n = s.n, z = n + s.m, of_x = P_.rows(), of_z = s.Ft.rows();
  PF_.setZero(of_z, n);
  Q_ = s.H;
  if (added) Q_ += *added;
  add_product(PF_.data(), of_z, s.Ft.data(), of_z, P_.data(), of_x, of_z, n, n);
  add_symmetric_product<Factors::kRows>(Q_.data(), of_z, s.Ft.data(), of_z, PF_.data(), of_z, of_z, n, z);
  slope_ = p_;
  add_columns(slope_.data(), P_.data(), of_x, s.c.data(), n, of_x);
  q_ = s.g;
  add_slope(s, slope_.data(), q_.data());
}

bool Riccati::take_input_curvature(Index n, Index m, double shift) {
  for (Index j = 0; j < m; ++j) {
    for (Index i = j; i < m; ++i) Q_uu_(i, j) = Q_uu_(j, i) = Q_(n + i, n + j);
    Q_uu_(j, j) += shift;
  }
  return Q_uu_.allFinite();
}

// False where Q_uu is not positive definite.
bool Riccati::factor() {
  const Index m = Q_uu_.cols();
  for (Index i = 0; i < m; ++i) {
    double* const row = Lt_.col(i).data();
    for (Index j = 0; j < i; ++j)
      row[j] = L_(i, j) = -inverse_[j] * (Q_uu_(i, j) - dot(row, Lt_.col(j).data(), j));
    const double pivot = Q_uu_(i, i) - dot(row, row, i);
    if (!(pivot > 0)) return false;
    inverse_[i] = 1 / std::sqrt(pivot);
  }
  return true;
}

// W = L^-1 Q_ux, whose rows are columns here, and w.
void Riccati::eliminate(Index n, Index m) {
  const Index of_x = P_.rows();
  w_ = q_.segment(n, m);
  for (Index i = 0; i < m; ++i) {
    double* const row = W_.col(i).data();
    for (Index j = 0; j < n; ++j) row[j] = Q_(n + i, j);
    add_columns(row, W_.data(), of_x, Lt_.col(i).data(), i, of_x);
    for (Index j = 0; j < of_x; ++j) row[j] *= inverse_[i];
    w_[i] = (w_[i] + dot(Lt_.col(i).data(), w_.data(), i)) * inverse_[i];
  }
  w_ = -w_;
}

// P = Q_xx - W^T W, p = q_x - W^T L^-1 q_u.
void Riccati::take_cost_to_go(Index n, Index m) {
  const Index of_x = P_.rows();
  add_symmetric_product<Factors::kMinusRows>(Q_.data(), Q_.rows(), W_.data(), of_x, W_.data(), of_x, of_x, m,
                                             n);
  for (Index j = 0; j < n; ++j) {
    for (Index i = j; i < n; ++i) P_(i, j) = P_(j, i) = Q_(i, j);
  }
  for (Index i = 0; i < n; ++i) p_[i] = q_[i];
  add_columns(p_.data(), W_.data(), of_x, w_.data(), m, of_x);
}

// k = L^-T w.
void Riccati::find_minimum(Index m) {
  policy_.k.resize(m);
  for (Index i = m; i-- > 0;) {
    const double behind = dot(L_.col(i).data() + i + 1, policy_.k.data() + i + 1, m - i - 1);
    policy_.k[i] = (w_[i] + behind) * inverse_[i];
  }
}

// K = - L^-T W.
void Riccati::find_gain(Index n, Index m) {
  const Index of_x = P_.rows();
  policy_.K.resize(m, n);
  for (Index i = m; i-- > 0;) {
    double* const row = W_.col(i).data();
    const Index behind = m - i - 1;
    if (behind > 0) add_columns(row, row + of_x, of_x, L_.col(i).data() + i + 1, behind, of_x);
    for (Index j = 0; j < of_x; ++j) row[j] *= inverse_[i];
    for (Index j = 0; j < n; ++j) policy_.K(i, j) = -row[j];
  }
}

bool Riccati::push(const LqrStage& stage, double shift) {
  stage_ = StageColumns(stage);
  return push(stage_, shift);
}

bool Riccati::push(const StageColumns& s, double shift, const MatrixXd* added) {
  resize(s.n, s.m);
  add_cost_to_go(s, added);
  if (!take_input_curvature(s.n, s.m, shift)) return false;
  const bool has_limits = s.lower.size() > 0;
  if (!factor()) return has_limits && push_limited(s, shift);
  eliminate(s.n, s.m);
  find_minimum(s.m);
  if (has_limits && !is_within(policy_.k, s.lower, s.upper)) return push_limited(s, shift);
  if (shift == 0) take_cost_to_go(s.n, s.m);
  find_gain(s.n, s.m);
  if (shift != 0) close(s.n, s.m, shift);
  return true;
}

}  // namespace dyntape
