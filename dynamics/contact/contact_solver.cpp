// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/contact/contact_solver.h>

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <limits>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/dynamics/contact/least_impulses.h>
#include <dyntape/dynamics/contact/smoothed_contact.h>

namespace dyntape::dynamics {

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

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

// By how much Alart and Curnier's equations do not hold, with their derivatives.
void alart_curnier(const ContactProblem& problem, const VectorXd& u, const VectorXd& p, VectorXd& F,
                   MatrixXd& derivatives) {
  const Eigen::Index m = p.size();
  F = p;
  derivatives.setIdentity(m, m);
  for_each_block(problem, [&](const ContactBlock& block, Eigen::Index first) {
    const double rho = contact_step(problem, block, first), z_n = p[first] - rho * u[first];
    const auto moved = [&](Eigen::Index row) {
      Eigen::RowVectorXd z = -rho * problem.D.row(row);
      z[row] += 1;
      return z;
    };
    if (z_n > 0) F[first] -= z_n, derivatives.row(first) -= moved(first);
    if (block.rows == 1) return;
    const Vector2d z_t = p.segment<2>(first + 1) - rho * u.segment<2>(first + 1);
    const double radius = block.friction * std::max(0.0, z_n), length = z_t.norm();
    if (length <= radius) {
      F.segment<2>(first + 1) -= z_t;
      for (int i = 1; i < 3; ++i) derivatives.row(first + i) -= moved(first + i);
    } else if (radius > 0) {
      const Vector2d along = z_t / length;
      F.segment<2>(first + 1) -= radius * along;
      const Eigen::RowVectorXd turn = along[0] * moved(first + 2) - along[1] * moved(first + 1);
      const Vector2d across(-along[1], along[0]);
      for (int i = 0; i < 2; ++i) {
        derivatives.row(first + 1 + i) -= block.friction * along[i] * moved(first);
        derivatives.row(first + 1 + i) -= radius / length * across[i] * turn;
      }
    }
  });
}

}  // namespace

Vector3d solve_one_contact(const Matrix3d& A, const Vector3d& b, double mu) {
  if (!(b[0] < 0) || !(A(0, 0) > 1e-14 * A.trace())) return Vector3d::Zero();
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
  if (!std::isfinite(at_zero)) return Vector3d::Zero();  // sweeps that diverge
  if (at_zero <= 0) return impulse(0, false);
  // Where friction brakes without end nothing slides, and the contact presses: a root lies between.
  double high = std::max(sliding.s[0], A(0, 0)), at_high = outside(high);
  for (int i = 0; at_high > 0 && i < 200; ++i) at_high = outside(high *= 8);
  if (!(at_high <= 0)) return Vector3d::Zero();
  if (at_high == 0) return impulse(high, true);
  std::uintmax_t most = 100;
  const auto root = boost::math::tools::toms748_solve(outside, 0.0, high, at_zero, at_high,
                                                      boost::math::tools::eps_tolerance<double>(52), most);
  return impulse(root.second, true);
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
  if (!std::isfinite(off)) return false;
  const double summed = (problem.D.cwiseAbs() * p.cwiseAbs() + problem.b.cwiseAbs()).maxCoeff();
  const double scale = std::max(summed, problem.size);
  if (off < residual_ || best_.size() != p.size()) {
    best_ = p;
    residual_ = off;
    goal_ = 4 * double(p.size() + 4) * kEpsilon * scale;
  }
  return residual_ <= goal_;
}

bool ContactSolver::polish(const ContactProblem& problem, VectorXd p) {
  VectorXd F;
  MatrixXd derivatives;
  for (int i = 0; i < 12; ++i) {
    const VectorXd u = problem.D * p + problem.b;
    alart_curnier(problem, u, p, F, derivatives);
    p -= least_norm_solution(derivatives, F);
    if (!p.allFinite()) return false;
    if (improve(problem, p)) return true;
  }
  return false;
}

bool ContactSolver::solve(const ContactProblem& problem, VectorXd& p) {
  constexpr double kSmall = 1e-8;
  sweeps_ = 0;
  residual_ = HUGE_VAL;
  best_.resize(0);
  bool solved = p.size() == 0 || improve(problem, p) || iterate(problem);
  if (!solved) {
    ContactProblem possible = problem;
    possible.b = problem.D * least_norm_solution(problem.D, problem.b, 1e-10);
    const double left_out = (possible.b - problem.b).cwiseAbs().maxCoeff();
    if (left_out > 0 && left_out <= kSmall * problem.b.cwiseAbs().maxCoeff()) {
      residual_ = HUGE_VAL;
      solved = iterate(possible);
    }
  }
  if (best_.size()) p = best_;
  // Of ill-conditioned ones rounding leaves more; what is left of the others may be little all the same.
  constexpr double kLittle = 1e-9;
  solved = solved || residual_ <= std::max(1e3 * goal_, kLittle * problem.b.cwiseAbs().maxCoeff());
  if (solved) take_least(problem, p);
  return solved;
}

// Of all impulses with the same velocities the least, if they obey the laws as well.
void ContactSolver::take_least(const ContactProblem& problem, VectorXd& p) const {
  const double scale = goal_ / (4 * double(p.size() + 4) * kEpsilon);
  for (const double still : {1e-10 * scale, goal_}) {
    const auto least = least_impulses(problem, p, still + residual_);
    if (!least) continue;
    const double off = contact_residual(problem, problem.D * *least + problem.b, *least);
    if (!(off <= std::max(residual_, goal_))) continue;
    p = *least;
    return;
  }
}

// Few sweeps from the best; where these do not do, with corners rounded; at last many sweeps.
bool ContactSolver::iterate(const ContactProblem& problem) {
  constexpr int kFew = 8, kMany = 500;
  VectorXd p = best_.size() ? best_ : VectorXd(VectorXd::Zero(problem.b.size()));
  if (sweep_and_polish(problem, p, kFew, 1)) return true;
  const auto done = [&](const VectorXd& at) { return improve(problem, at); };
  if (solve_smoothed(problem, p, done) || residual_ <= 1e3 * goal_) return true;
  if (best_.size()) p = best_;
  return sweep_and_polish(problem, p, kMany, 0.5);
}

// Each sweep takes `share` of the way: what goes in circles settles.
bool ContactSolver::sweep_and_polish(const ContactProblem& problem, VectorXd& p, int most, double share) {
  for (int i = 0; i < most; ++i) {
    const VectorXd before = p;
    sweep(problem, p);
    p = before + share * (p - before);
    ++sweeps_;
    if (improve(problem, p)) return true;
  }
  return polish(problem, p);
}

}  // namespace dyntape::dynamics
