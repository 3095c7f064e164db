// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/contact/contact_problem.h>

#include <algorithm>
#include <cmath>

namespace dyntape::dynamics {

using Eigen::Vector3d;
using Eigen::VectorXd;

double contact_step(const ContactProblem& problem, const ContactBlock& block, Eigen::Index first) {
  const double own = problem.D.diagonal().segment(first, block.rows).sum();
  const double all = problem.D.diagonal().sum();
  return own > 0 ? block.rows / own : all > 0 ? double(problem.b.size()) / all : 1;
}

Vector3d project_on_cone(const Vector3d& x, double mu) {
  const double length = x.tail<2>().norm();
  if (length <= mu * x[0]) return x;
  if (mu * length <= -x[0]) return Vector3d::Zero();
  const double n = (x[0] + mu * length) / (1 + mu * mu);
  const double t = mu * n / length;
  return {n, t * x[1], t * x[2]};
}

double contact_residual(const ContactProblem& problem, const VectorXd& u, const VectorXd& p) {
  double most = 0;
  for_each_block(problem, [&](const ContactBlock& block, Eigen::Index first) {
    const double rho = contact_step(problem, block, first);
    double off = 0;
    if (block.rows == 1) {
      off = std::abs(std::min(p[first] / rho, u[first]));
    } else {
      const Vector3d p_i = p.segment<3>(first);
      Vector3d w = u.segment<3>(first);
      w[0] += block.friction * w.tail<2>().norm();
      off = (p_i - project_on_cone(p_i - rho * w, block.friction)).cwiseAbs().maxCoeff() / rho;
    }
    if (!(off <= most)) most = off;  // NaN as well
  });
  return most;
}

}  // namespace dyntape::dynamics
