// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/contact/impact.h>

#include <algorithm>

namespace dyntape::dynamics {

namespace {

ImpactImpulses with_share(ContactSolver& solver, const Eigen::MatrixXd& D,
                          const std::vector<ContactBlock>& blocks, const std::vector<double>& restitution,
                          const Eigen::VectorXd& u, double size, double share) {
  ContactProblem problem{D, u, blocks, size};
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    problem.b[first] += share * restitution[i] * std::min(u[first], 0.0);
    first += blocks[i].rows;
  }
  ImpactImpulses impact;
  impact.p = Eigen::VectorXd::Zero(u.size());
  impact.solved = solver.solve(problem, impact.p);
  impact.u = u + D * impact.p;
  impact.energy = impact.p.dot(u + impact.u) / 2;
  impact.restitution = share;
  return impact;
}

}  // namespace

ImpactImpulses solve_impact(ContactSolver& solver, const Eigen::MatrixXd& D,
                            const std::vector<ContactBlock>& blocks, const std::vector<double>& restitution,
                            const Eigen::VectorXd& u, double size) {
  constexpr int kHalvings = 30;
  const auto creates_energy = [&](const ImpactImpulses& impact) {
    const double moved = impact.p.cwiseAbs().dot(u.cwiseAbs() + impact.u.cwiseAbs());
    return impact.energy > 1e-13 * (moved + size * impact.p.cwiseAbs().sum());
  };
  ImpactImpulses impact = with_share(solver, D, blocks, restitution, u, size, 1);
  if (impact.solved && !creates_energy(impact)) return impact;
  impact = with_share(solver, D, blocks, restitution, u, size, 0);
  double low = 0, high = 1;
  for (int i = 0; i < kHalvings; ++i) {
    const double share = (low + high) / 2;
    ImpactImpulses next = with_share(solver, D, blocks, restitution, u, size, share);
    const bool sound = next.solved && !creates_energy(next);
    (sound ? low : high) = share;
    if (sound) impact = std::move(next);
  }
  return impact;
}

}  // namespace dyntape::dynamics
