// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/riccati.h>

#include <dyntape/interface/control/riccati/columns.h>

namespace dyntape {

using namespace columns;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<Eigen::Index> places_of(const std::vector<bool>& chosen) {
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i]) places.push_back(Eigen::Index(i));
  }
  return places;
}

double value_of(const MatrixXd& H, const VectorXd& g, const VectorXd& u) {
  return u.dot(H * u) / 2 + g.dot(u);
}

}  // namespace

// Each round holds the inputs that are at a limit and would go beyond, and takes Newton's step of the others, shortened
// until the cost goes down.
VectorXd box_minimum(const MatrixXd& H, const VectorXd& g, const VectorXd& lower, const VectorXd& upper,
                     std::vector<bool>& is_free) {
  constexpr int kMostRounds = 100, kHalvings = 40;
  const auto clamped = [&](const VectorXd& u) { return VectorXd(u.cwiseMax(lower).cwiseMin(upper)); };
  VectorXd u = clamped(VectorXd::Zero(g.size()));
  is_free.assign(std::size_t(g.size()), true);
  for (int round = 0; round < kMostRounds; ++round) {
    const VectorXd slope = H * u + g;
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      const bool stays = (u[i] <= lower[i] && slope[i] > 0) || (u[i] >= upper[i] && slope[i] < 0);
      is_free[std::size_t(i)] = !stays;
    }
    const std::vector<Eigen::Index> free = places_of(is_free);
    VectorXd step = VectorXd::Zero(u.size());
    if (!free.empty()) step(free) = -H(free, free).llt().solve(slope(free));
    const double now = value_of(H, g, u);
    VectorXd next = clamped(u + step);
    for (int i = 0; i < kHalvings && value_of(H, g, next) > now; ++i) next = clamped(u + (step /= 2));
    const bool is_done = (next - u).cwiseAbs().maxCoeff() <= 1e-14 * (1 + u.cwiseAbs().maxCoeff());
    u = std::move(next);
    if (is_done || free.empty()) break;
  }
  return u;
}

namespace {

bool is_positive(const MatrixXd& H) {
  return H.size() == 0 || Eigen::LLT<MatrixXd>(H).info() == Eigen::Success;
}

// The same where H is positive definite only among the inputs that are not held where they are: by limits that leave no room,
// or, where the others need it, by a limit that they would go beyond.  False: not even there.
bool limited_minimum(const MatrixXd& H, const VectorXd& g, const VectorXd& lower, const VectorXd& upper,
                     VectorXd& u, std::vector<bool>& is_free) {
  const auto open = [&](bool only_inside) {
    std::vector<Eigen::Index> places;
    for (Eigen::Index i = 0; i < g.size(); ++i) {
      const bool at_limit = (lower[i] >= 0 && g[i] > 0) || (upper[i] <= 0 && g[i] < 0);
      if (lower[i] < upper[i] && !(only_inside && at_limit)) places.push_back(i);
    }
    return places;
  };
  std::vector<Eigen::Index> places = open(false);
  if (!is_positive(H(places, places))) places = open(true);
  if (!is_positive(H(places, places))) return false;
  u = VectorXd::Zero(g.size()).cwiseMax(lower).cwiseMin(upper);
  is_free.assign(std::size_t(g.size()), false);
  if (places.empty()) return true;
  std::vector<bool> is_free_there;
  VectorXd held = u;
  held(places).setZero();
  const VectorXd slope = (g + H * held)(places);
  u(places) = box_minimum(H(places, places), slope, lower(places), upper(places), is_free_there);
  for (std::size_t i = 0; i < places.size(); ++i) is_free[std::size_t(places[i])] = is_free_there[i];
  return true;
}

}  // namespace

void Riccati::begin(const MatrixXd& H, const VectorXd& g) {
  P_ = H;
  p_ = g;
}

// Q and q: the lower triangle.
void Riccati::add_cost_to_go(const LqrStage& s) {
  const Eigen::Index n = s.A.cols(), m = s.B.cols(), z = n + m, of_x = padded(n), of_z = padded(z);
  if (F_.rows() != n || F_.cols() != z) {
    // What is behind the rows stays zero.
    padded_P_.setZero(of_x, n), Ft_.setZero(of_z, n), Q_.setZero(of_z, z);
    F_.resize(n, z);
  }
  padded_P_.topRows(n) = P_;
  F_ << s.A, s.B;
  Ft_.topRows(z) = F_.transpose();
  PF_.setZero(of_x, z);
  Q_.topRows(z) = s.H;
  add_product(PF_.data(), of_x, padded_P_.data(), of_x, F_.data(), n, of_x, n, z);
  add_symmetric_product(Q_.data(), of_z, Ft_.data(), of_z, PF_.data(), of_x, of_z, n, z);
  slope_.setZero(of_x), slope_.head(n) = p_;
  add_columns(slope_.data(), padded_P_.data(), of_x, s.c.data(), n, of_x);
  q_.setZero(of_z), q_.head(z) = s.g;
  add_columns(q_.data(), Ft_.data(), of_z, slope_.data(), n, of_z);
}

// With Q_uu = L L^T and W = L^-1 Q_ux:  K = - L^-T W,  P = Q_xx - W^T W; rows of W are columns here.
void Riccati::minimise(Eigen::Index n, Eigen::Index m) {
  const Eigen::Index of_x = padded(n);
  L_ = factors_.matrixLLT();
  Lt_ = -L_.transpose();
  W_.resize(of_x, m), Wt_.resize(m, n);
  w_ = q_.segment(n, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    double* const row = W_.col(i).data();
    for (Eigen::Index j = 0; j < n; ++j) row[j] = Q_(n + i, j);
    for (Eigen::Index j = n; j < of_x; ++j) row[j] = 0;
    add_columns(row, W_.data(), of_x, Lt_.col(i).data(), i, of_x);
    const double inverse = 1 / L_(i, i);
    for (Eigen::Index j = 0; j < of_x; ++j) row[j] *= inverse;
    for (Eigen::Index j = 0; j < n; ++j) Wt_(i, j) = -row[j];
    w_[i] = (w_[i] + dot(Lt_.col(i).data(), w_.data(), i)) * inverse;
  }
  add_symmetric_product(Q_.data(), Q_.rows(), W_.data(), of_x, Wt_.data(), m, of_x, m, n);
  P_.resize(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) P_(i, j) = P_(j, i) = Q_(i, j);
  }
  p_ = q_.head(n);
  for (Eigen::Index i = 0; i < m; ++i) add(p_.data(), -w_[i], W_.col(i).data(), n);
  policy_.K.resize(m, n), policy_.k.resize(m);
  L_ = -L_;
  for (Eigen::Index i = m; i-- > 0;) {
    double* const row = W_.col(i).data();
    const Eigen::Index behind = m - i - 1;
    const double* const of_L = L_.col(i).data() + i;
    if (behind > 0) add_columns(row, row + of_x, of_x, of_L + 1, behind, of_x);
    const double inverse = -1 / of_L[0];
    for (Eigen::Index j = 0; j < of_x; ++j) row[j] *= inverse;
    for (Eigen::Index j = 0; j < n; ++j) policy_.K(i, j) = -row[j];
    w_[i] = (w_[i] + dot(of_L + 1, w_.data() + i + 1, behind)) * inverse;
    policy_.k[i] = -w_[i];
  }
}

bool Riccati::push(const LqrStage& s, double shift) {
  const Eigen::Index n = s.A.cols(), m = s.B.cols();
  add_cost_to_go(s);
  Q_uu_ = Q_.block(n, n, m, m);
  Q_uu_.triangularView<Eigen::StrictlyUpper>() = Q_uu_.transpose();
  Q_uu_.diagonal().array() += shift;
  if (!Q_uu_.allFinite()) return false;
  const bool is_limited = s.lower.size() > 0;
  if (!is_limited) {
    factors_.compute(Q_uu_);
    if (factors_.info() != Eigen::Success) return false;
  }
  if (!is_limited && shift == 0) {
    minimise(n, m);
    return true;
  }

  const auto Q_ux = Q_.block(n, 0, m, n);
  if (is_limited) {
    policy_.K.setZero(m, n);
    std::vector<bool> is_free;
    if (!limited_minimum(Q_uu_, q_.segment(n, m), s.lower, s.upper, policy_.k, is_free)) return false;
    const std::vector<Eigen::Index> free = places_of(is_free);
    if (!free.empty()) policy_.K(free, Eigen::all) = -Q_uu_(free, free).llt().solve(Q_ux(free, Eigen::all));
  } else {
    policy_.k = -factors_.solve(q_.segment(n, m));
    policy_.K = -factors_.solve(Q_ux);
  }
  Q_uu_.diagonal().array() -= shift;
  P_ = Q_.topLeftCorner(n, n).triangularView<Eigen::Lower>();
  P_.triangularView<Eigen::StrictlyUpper>() = P_.transpose();
  P_ += Q_ux.transpose() * policy_.K + policy_.K.transpose() * (Q_ux + Q_uu_ * policy_.K);
  p_ = q_.head(n) + Q_ux.transpose() * policy_.k +
       policy_.K.transpose() * (q_.segment(n, m) + Q_uu_ * policy_.k);
  P_ = (P_ + P_.transpose()).eval() / 2;
  return true;
}

}  // namespace dyntape
