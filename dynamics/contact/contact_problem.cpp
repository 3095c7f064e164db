// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/contact/contact_problem.h>

#include <Eigen/QR>
#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <limits>

namespace dyntape::dynamics {

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// visit(block, first row)
template <class Visit>
void for_each_block(const ContactProblem& problem, Visit visit) {
  Eigen::Index first = 0;
  for (const ContactBlock& block : problem.blocks) {
    visit(block, first);
    first += block.rows;
  }
}

// A contact that nothing can move has no step of its own.
double step_of(const ContactProblem& problem, const ContactBlock& block, Eigen::Index first) {
  const double own = problem.D.diagonal().segment(first, block.rows).sum();
  const double all = problem.D.diagonal().sum();
  return own > 0 ? block.rows / own : all > 0 ? double(problem.b.size()) / all : 1;
}

// Tangential directions in which the normal and the two others do not speak to each other: with p_n eliminated,
// (s_i + kappa) p_i = - c_i.
struct Sliding {
  Sliding(const Matrix3d& A, const Vector3d& b) : normal(A(0, 0)), pressed(b[0]) {
    const Vector2d a(A(0, 1), A(0, 2));
    const double s11 = A(1, 1) - a[0] * a[0] / normal, s22 = A(2, 2) - a[1] * a[1] / normal;
    const double s12 = (A(1, 2) + A(2, 1)) / 2 - a[0] * a[1] / normal;
    const double angle = 0.5 * std::atan2(2 * s12, s11 - s22), co = std::cos(angle), si = std::sin(angle);
    Q << co, -si, si, co;
    const double mean = (s11 + s22) / 2, half = std::hypot((s11 - s22) / 2, s12);
    s = {std::max(0.0, mean + half), std::max(0.0, mean - half)};
    c = Q.transpose() * (b.tail<2>() - a * (pressed / normal));
    coupling = Q.transpose() * a;
    least = 1e-14 * A.trace();
  }
  // Along a direction that cannot be moved there is no force.
  Vector2d tangential(double kappa) const {
    Vector2d p;
    for (int i = 0; i < 2; ++i) p[i] = s[i] + kappa > least ? -c[i] / (s[i] + kappa) : 0;
    return p;
  }
  double pressure(const Vector2d& p) const { return -(pressed + coupling.dot(p)) / normal; }

  double normal, pressed, least = 0;
  Eigen::Matrix2d Q;
  Vector2d s, c, coupling;
};

// By how much Alart and Curnier's equations do not hold, with their slopes.
void alart_curnier(const ContactProblem& problem, const VectorXd& u, const VectorXd& p, VectorXd& F,
                   MatrixXd& slopes) {
  const Eigen::Index m = p.size();
  F = p;
  slopes.setIdentity(m, m);
  for_each_block(problem, [&](const ContactBlock& block, Eigen::Index first) {
    const double rho = step_of(problem, block, first), z_n = p[first] - rho * u[first];
    const auto moved = [&](Eigen::Index row) {
      Eigen::RowVectorXd z = -rho * problem.D.row(row);
      z[row] += 1;
      return z;
    };
    if (z_n > 0) F[first] -= z_n, slopes.row(first) -= moved(first);
    if (block.rows == 1) return;
    const Vector2d z_t = p.segment<2>(first + 1) - rho * u.segment<2>(first + 1);
    const double radius = block.friction * std::max(0.0, z_n), length = z_t.norm();
    if (length <= radius) {
      F.segment<2>(first + 1) -= z_t;
      for (int i = 1; i < 3; ++i) slopes.row(first + i) -= moved(first + i);
    } else if (radius > 0) {
      const Vector2d along = z_t / length;
      F.segment<2>(first + 1) -= radius * along;
      const Eigen::RowVectorXd turn = along[0] * moved(first + 2) - along[1] * moved(first + 1);
      const Vector2d across(-along[1], along[0]);
      for (int i = 0; i < 2; ++i) {
        slopes.row(first + 1 + i) -= block.friction * along[i] * moved(first);
        slopes.row(first + 1 + i) -= radius / length * across[i] * turn;
      }
    }
  });
}

}  // namespace

Vector3d project_on_cone(const Vector3d& x, double mu) {
  const double length = x.tail<2>().norm();
  if (length <= mu * x[0]) return x;
  if (mu * length <= -x[0]) return Vector3d::Zero();
  const double n = (x[0] + mu * length) / (1 + mu * mu);
  const double t = mu * n / length;
  return {n, t * x[1], t * x[2]};
}

Vector3d solve_one_contact(const Matrix3d& A, const Vector3d& b, double mu) {
  if (b[0] >= 0 || !(A(0, 0) > 1e-14 * A.trace())) return Vector3d::Zero();
  if (mu == 0) return {-b[0] / A(0, 0), 0, 0};
  const Sliding sliding(A, b);
  const auto outside = [&](double kappa) {
    const Vector2d p = sliding.tangential(kappa);
    return p.norm() - mu * sliding.pressure(p);
  };
  const auto impulse = [&](double kappa, bool slides) -> Vector3d {
    Vector2d p = sliding.tangential(kappa);
    const double pressure = std::max(0.0, sliding.pressure(p));
    if (slides && p.norm() > 0) p *= mu * pressure / p.norm();
    p = sliding.Q * p;
    return {pressure, p[0], p[1]};
  };
  const double at_zero = outside(0);
  if (at_zero <= 0) return impulse(0, false);
  // Where friction brakes without end nothing slides, and the contact presses: a root lies between.
  double high = std::max(sliding.s[0], A(0, 0)), at_high = outside(high);
  for (int i = 0; at_high > 0 && i < 200; ++i) at_high = outside(high *= 8);
  if (at_high > 0) return Vector3d::Zero();
  if (at_high == 0) return impulse(high, true);
  std::uintmax_t most = 100;
  const auto root = boost::math::tools::toms748_solve(outside, 0.0, high, at_zero, at_high,
                                                      boost::math::tools::eps_tolerance<double>(52), most);
  return impulse(root.second, true);
}

double contact_residual(const ContactProblem& problem, const VectorXd& u, const VectorXd& p) {
  double most = 0;
  for_each_block(problem, [&](const ContactBlock& block, Eigen::Index first) {
    const double rho = step_of(problem, block, first);
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

void ContactSolver::sweep(const ContactProblem& problem, VectorXd& p) const {
  for_each_block(problem, [&](const ContactBlock& block, Eigen::Index first) {
    const Eigen::Index rows = block.rows;
    const auto own = problem.D.block(first, first, rows, rows);
    const VectorXd b =
        problem.b.segment(first, rows) + problem.D.middleRows(first, rows) * p - own * p.segment(first, rows);
    if (rows == 3) {
      p.segment<3>(first) = solve_one_contact(own, Vector3d(b), block.friction);
    } else {
      p[first] = own(0, 0) > 0 ? std::max(0.0, -b[0] / own(0, 0)) : 0;
    }
  });
}

// Whether p is a solution; the best is kept.
bool ContactSolver::improve(const ContactProblem& problem, const VectorXd& p) {
  if (!p.allFinite()) return false;
  const VectorXd u = problem.D * p + problem.b;
  const double off = contact_residual(problem, u, p);
  const double summed = (problem.D.cwiseAbs() * p.cwiseAbs() + problem.b.cwiseAbs()).maxCoeff();
  const double scale = std::max(summed, problem.size);
  if (off < residual_ || best_.size() != p.size()) {
    best_ = p;
    residual_ = off;
    goal_ = 4 * double(p.size() + 4) * kEpsilon * scale;
  }
  return residual_ <= goal_;
}

void ContactSolver::polish(const ContactProblem& problem, VectorXd p) {
  VectorXd F;
  MatrixXd slopes;
  for (int i = 0; i < 12; ++i) {
    const VectorXd u = problem.D * p + problem.b;
    alart_curnier(problem, u, p, F, slopes);
    p -= slopes.completeOrthogonalDecomposition().solve(F);
    if (!p.allFinite() || improve(problem, p)) return;
  }
}

bool ContactSolver::solve(const ContactProblem& problem, VectorXd& p) {
  constexpr int kFirst = 5, kAll = 12;
  constexpr double kSmall = 1e-8;
  sweeps_ = 0;
  if (iterate(problem, p, kFirst)) return true;
  ContactProblem possible = problem;
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> D;
  D.setThreshold(1e-10);
  possible.b = problem.D * D.compute(problem.D).solve(problem.b);
  const double left_out = (possible.b - problem.b).cwiseAbs().maxCoeff();
  if (left_out <= kSmall * problem.b.cwiseAbs().maxCoeff()) return iterate(possible, p, kAll);
  return iterate(problem, p, kAll);
}

// So many rounds from p, each longer than the one before.
bool ContactSolver::iterate(const ContactProblem& problem, VectorXd& p, int rounds) {
  residual_ = HUGE_VAL;
  best_.resize(0);
  if (p.size() == 0 || improve(problem, p)) return true;
  VectorXd moving = best_.size() ? best_ : VectorXd(VectorXd::Zero(problem.b.size()));
  bool solved = false;
  for (int round = 0; round < rounds && !solved; ++round) {
    const int most = sweeps_ + (8 << std::min(round, 7));
    while (!solved && sweeps_ < most) {
      const VectorXd before = moving;
      sweep(problem, moving);
      if (round % 2 == 1) moving = (before + moving) / 2;  // what goes in circles settles
      ++sweeps_;
      solved = improve(problem, moving);
    }
    if (solved) break;
    const double before = residual_;
    polish(problem, moving);
    solved = residual_ <= goal_;
    if (residual_ < 0.1 * before) moving = best_;
  }
  p = best_;
  // Of ill-conditioned ones rounding leaves more.
  return solved || residual_ <= 1e3 * goal_;
}

}  // namespace dyntape::dynamics
