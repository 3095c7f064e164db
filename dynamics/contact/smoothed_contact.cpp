// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/contact/smoothed_contact.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/factorisations.h>

namespace dyntape::dynamics {

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// (l + sqrt(l^2 + 4 tau^2)) / 2, without cancellation, and its slope.
double rounded(double l, double tau) {
  const double root = std::hypot(l, 2 * tau);
  return l >= 0 ? (l + root) / 2 : 2 * tau * tau / (root - l);
}
double rounded_slope(double l, double tau) { return rounded(l, tau) / std::hypot(l, 2 * tau); }

struct Equations {
  VectorXd F;
  MatrixXd derivatives;
};

// Row `first`: a contact without friction.
void add_normal(const ContactProblem& problem, Eigen::Index first, double u, double p, double rho, double tau,
                Equations& all) {
  const double z = p - rho * u, slope = rounded_slope(z, tau);
  all.F[first] = p - rounded(z, tau);
  all.derivatives.row(first) = slope * rho * problem.D.row(first);
  all.derivatives(first, first) += 1 - slope;
}

// Rows first to first + 2, mu > 0.
void add_cone(const ContactProblem& problem, Eigen::Index first, double mu, const Vector3d& u,
              const Vector3d& p, double rho, double tau, Equations& all) {
  const Vector2d u_t = u.tail<2>();
  const double speed = std::hypot(u_t.norm(), tau / rho);
  const Vector3d scaled(mu * p[0], p[1], p[2]), w(u[0] / mu + speed, u_t[0], u_t[1]), z = scaled - rho * w;
  const double length = z.tail<2>().norm(), high = z[0] + length, low = z[0] - length;
  const Vector2d along = length > 0 ? Vector2d(z.tail<2>() / length) : Vector2d(1, 0);
  const double P_high = rounded(high, tau), P_low = rounded(low, tau);
  all.F[first] = scaled[0] - (P_high + P_low) / 2;
  all.F.segment<2>(first + 1) = scaled.tail<2>() - (P_high - P_low) / 2 * along;

  const double s_high = rounded_slope(high, tau), s_low = rounded_slope(low, tau);
  const double mean = (s_high + s_low) / 2, half = (s_high - s_low) / 2;
  const double across = length > 0 ? (P_high - P_low) / (2 * length) : s_high;
  Matrix3d dP;
  dP(0, 0) = mean;
  dP.block<1, 2>(0, 1) = half * along.transpose();
  dP.block<2, 1>(1, 0) = half * along;
  dP.block<2, 2>(1, 1) = across * Matrix2d::Identity() + (mean - across) * along * along.transpose();
  Matrix3d dw = Vector3d(1 / mu, 1, 1).asDiagonal();
  dw.block<1, 2>(0, 1) = u_t.transpose() / speed;
  all.derivatives.middleRows<3>(first) = dP * rho * dw * problem.D.middleRows<3>(first);
  all.derivatives.block<3, 3>(first, first) += (Matrix3d::Identity() - dP) * Vector3d(mu, 1, 1).asDiagonal();
}

void equations_at(const ContactProblem& problem, const VectorXd& p, const std::vector<double>& rho,
                  double tau, Equations& all) {
  const VectorXd u = problem.D * p + problem.b;
  all.F.resize(p.size());
  all.derivatives.resize(p.size(), p.size());
  auto step = rho.begin();
  for_each_block(problem, [&](const ContactBlock& block, Eigen::Index first) {
    if (block.rows == 3 && block.friction > 0) {
      add_cone(problem, first, block.friction, u.segment<3>(first), p.segment<3>(first), *step, tau, all);
    } else {
      add_normal(problem, first, u[first], p[first], *step, tau, all);
      for (Eigen::Index row = first + 1; row < first + block.rows; ++row) {
        all.F[row] = p[row];
        all.derivatives.row(row).setZero();
        all.derivatives(row, row) = 1;
      }
    }
    ++step;
  });
}

}  // namespace

bool solve_smoothed(const ContactProblem& problem, VectorXd& p,
                    const std::function<bool(const VectorXd&)>& done) {
  std::vector<double> rho;
  double tau = 0;
  for_each_block(problem, [&](const ContactBlock& block, Eigen::Index first) {
    rho.push_back(contact_step(problem, block, first));
    tau = std::max(tau, rho.back() * problem.b.segment(first, block.rows).cwiseAbs().maxCoeff());
  });
  p.setZero(problem.b.size());
  if (!(tau > 0)) return done(p);
  const double least = std::max(1e-18 * tau, 1e-300);
  double shrink = 0.1;
  Equations now, next;
  equations_at(problem, p, rho, tau, now);
  for (int i = 0; i < kMostSmoothedSteps && tau > least; ++i) {
    if (now.F.norm() <= tau / 2) equations_at(problem, p, rho, tau *= shrink, now);
    const VectorXd direction = solve_square(now.derivatives, VectorXd(-now.F));
    if (!direction.allFinite()) return false;
    double length = 1;
    for (int k = 0; k < 12; ++k, length /= 2) {
      equations_at(problem, p + length * direction, rho, tau, next);
      if (next.F.norm() <= (1 - 1e-4 * length) * now.F.norm()) break;
    }
    p += length * direction;
    std::swap(now, next);
    if (done(p)) return true;
    shrink = length < 0.3 ? std::min(0.7, 2 * shrink) : std::max(0.1, 0.7 * shrink);  // by how steps succeed
  }
  return false;
}

}  // namespace dyntape::dynamics
