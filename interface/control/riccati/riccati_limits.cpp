// SPDX-License-Identifier: BSD-3-Clause
//
// Stages with active limits of inputs.
#include <dyntape/interface/control/riccati/riccati.h>

#include <dyntape/autodiff/factorisations.h>

namespace dyntape {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

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

// Each iteration fixes the inputs that are at a limit and would exceed it, and takes the Newton step of the others,
// shortened until the cost decreases.
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
    if (!free.empty()) step(free) = -solve_positive(H(free, free), VectorXd(slope(free)));
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

// The same if H is positive definite only for some inputs: others are fixed by equal limits or, if necessary, at a
// limit that they would exceed.  Returns false if this fails too.
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
  if (!is_positive_definite(H(places, places))) places = open(true);
  if (!is_positive_definite(H(places, places))) return false;
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

bool Riccati::push_limited(const StageColumns& s, double shift) {
  const auto Q_ux = Q_.block(s.n, 0, s.m, s.n);
  policy_.K.setZero(s.m, s.n);
  std::vector<bool> is_free;
  if (!limited_minimum(Q_uu_, q_.segment(s.n, s.m), s.lower, s.upper, policy_.k, is_free)) return false;
  const std::vector<Index> free = places_of(is_free);
  if (!free.empty())
    policy_.K(free, Eigen::all) = -solve_positive(Q_uu_(free, free), MatrixXd(Q_ux(free, Eigen::all)));
  close(s.n, s.m, shift);
  return true;
}

// The cost-to-go of the current policy.
void Riccati::close(Index n, Index m, double shift) {
  const auto Q_ux = Q_.block(n, 0, m, n);
  Q_uu_.diagonal().array() -= shift;
  rest_ = Q_ux;
  rest_.noalias() += Q_uu_ * policy_.K;
  for (Index j = 0; j < n; ++j) {
    for (Index i = j; i < n; ++i) P_(i, j) = P_(j, i) = Q_(i, j);
  }
  auto P = P_.topRows(n);
  P.noalias() += Q_ux.transpose() * policy_.K;
  P.noalias() += policy_.K.transpose() * rest_;
  for (Index j = 0; j < n; ++j) {
    for (Index i = j + 1; i < n; ++i) P(i, j) = P(j, i) = (P(i, j) + P(j, i)) / 2;
  }
  w_ = q_.segment(n, m);
  w_.noalias() += Q_uu_ * policy_.k;
  auto p = p_.head(n);
  p = q_.head(n);
  p.noalias() += Q_ux.transpose() * policy_.k;
  p.noalias() += policy_.K.transpose() * w_;
}

}  // namespace dyntape
