// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/solvers/riccati.h>

#include <Eigen/Cholesky>

namespace dyntape {

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

bool Riccati::push(const LqStage& s, double shift) {
  const Eigen::Index n = s.A.cols(), m = s.B.cols();
  F_.resize(n, n + m);
  F_ << s.A, s.B;
  PF_.noalias() = P_ * F_;
  Q_ = s.H;
  Q_.noalias() += F_.transpose() * PF_;
  q_ = s.g + F_.transpose() * (p_ + P_ * s.c);

  MatrixXd Q_uu = Q_.bottomRightCorner(m, m);
  Q_uu.diagonal().array() += shift;
  if (!Q_uu.allFinite()) return false;
  const auto Q_ux = Q_.bottomLeftCorner(m, n);
  policy_.K.setZero(m, n);
  const bool is_limited = s.lower.size() > 0;
  const Eigen::LLT<MatrixXd> factors(Q_uu);
  if (!is_limited && factors.info() != Eigen::Success) return false;
  if (is_limited) {
    std::vector<bool> is_free;
    if (!limited_minimum(Q_uu, q_.tail(m), s.lower, s.upper, policy_.k, is_free)) return false;
    const std::vector<Eigen::Index> free = places_of(is_free);
    if (!free.empty()) policy_.K(free, Eigen::all) = -Q_uu(free, free).llt().solve(Q_ux(free, Eigen::all));
  } else {
    policy_.k = -factors.solve(q_.tail(m));
    policy_.K = -factors.solve(Q_ux);
  }

  P_ = Q_.topLeftCorner(n, n) + Q_ux.transpose() * policy_.K;
  p_ = q_.head(n) + Q_ux.transpose() * policy_.k;
  if (shift > 0 || is_limited) {
    const MatrixXd rest = Q_ux + Q_.bottomRightCorner(m, m) * policy_.K;
    P_ += policy_.K.transpose() * rest;
    p_ += policy_.K.transpose() * (q_.tail(m) + Q_.bottomRightCorner(m, m) * policy_.k);
  }
  P_ = (P_ + P_.transpose()).eval() / 2;
  return true;
}

}  // namespace dyntape
