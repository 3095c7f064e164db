// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/contact/least_impulses.h>

#include <Eigen/Cholesky>
#include <cmath>

#include <dyntape/autodiff/factorisations.h>

namespace dyntape::dynamics {

namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// The derivative of project_on_cone().
Matrix3d cone_derivative(const Vector3d& x, double mu) {
  const Vector2d t = x.tail<2>();
  const double length = t.norm();
  if (length <= mu * x[0]) return Matrix3d::Identity();
  if (mu * length <= -x[0]) return Matrix3d::Zero();
  const Vector2d along = t / length;
  const Vector3d edge(1, mu * along[0], mu * along[1]);
  const double share = 1 + mu * mu, size = (x[0] + mu * length) / share;
  Matrix3d P = edge * edge.transpose() / share;
  P.bottomRightCorner<2, 2>() +=
      mu * size / length * (Eigen::Matrix2d::Identity() - along * along.transpose());
  return P;
}

// The cones that impulses are in while velocities are u.
class ImpulseCones {
 public:
  ImpulseCones(const ContactProblem& problem, const VectorXd& u, double still) : problem_(problem) {
    for_each_block(problem, [&](const ContactBlock& block, Index first) {
      VectorXd ray = VectorXd::Zero(block.rows);
      const bool presses = u[first] <= still;
      bool is_ray = true;
      if (presses) ray[0] = 1;
      if (presses && block.rows == 3 && block.friction > 0) {
        const Vector2d slip = u.segment<2>(first + 1);
        is_ray = slip.norm() > still;
        if (is_ray) ray.tail<2>() = -block.friction / slip.norm() * slip;
      }
      rays_.push_back(ray), is_ray_.push_back(is_ray);
    });
  }

  VectorXd project(const VectorXd& x, MatrixXd* derivative) const {
    VectorXd p = VectorXd::Zero(x.size());
    if (derivative) derivative->setZero(x.size(), x.size());
    std::size_t k = 0;
    for_each_block(problem_, [&](const ContactBlock& block, Index first) {
      const VectorXd& ray = rays_[k];
      const Index rows = block.rows;
      if (!is_ray_[k++]) {
        p.segment<3>(first) = project_on_cone(x.segment<3>(first), block.friction);
        if (derivative)
          derivative->block<3, 3>(first, first) = cone_derivative(x.segment<3>(first), block.friction);
        return;
      }
      const double along = ray.dot(x.segment(first, rows));
      if (!(along > 0)) return;
      p.segment(first, rows) = along / ray.squaredNorm() * ray;
      if (derivative) derivative->block(first, first, rows, rows) = ray * ray.transpose() / ray.squaredNorm();
    });
    return p;
  }

 private:
  const ContactProblem& problem_;
  std::vector<VectorXd> rays_;
  std::vector<bool> is_ray_;
};

}  // namespace

std::optional<VectorXd> least_impulses(const ContactProblem& problem, const VectorXd& p, double still) {
  constexpr double kDependentRows = 1e-10, kToRounding = 1e-14;
  constexpr int kMostSteps = 60;
  if (p.isZero(0)) return std::nullopt;
  const OrthonormalBasis basis = orthonormal_basis(problem.D, kDependentRows);
  if (basis.rank == p.size()) return std::nullopt;
  const MatrixXd range = basis.range();
  const ImpulseCones cones(problem, problem.D * p + problem.b, still);
  const VectorXd kept = range.transpose() * p;
  VectorXd y = kept;  // the answer wherever the least of all p with this D p is in the cones
  MatrixXd P;
  const auto value = [&](const VectorXd& at) {
    return cones.project(range * at, nullptr).squaredNorm() / 2 - kept.dot(at);
  };
  double before = HUGE_VAL;
  for (int step = 0; step < kMostSteps; ++step) {
    const VectorXd least = cones.project(range * y, &P);
    const VectorXd off = range.transpose() * least - kept;
    const double size = off.norm() / kept.norm();
    // Ends where steps no longer help, as what is left then is rounding.
    if (size <= kToRounding || (size <= 100 * kToRounding && size > before / 2)) return least;
    before = size;
    MatrixXd slope = range.transpose() * P * range;
    slope.diagonal().array() += 1e-12;
    const VectorXd direction = -slope.ldlt().solve(off);
    const double now = value(y), rate = off.dot(direction);
    double length = 1;
    while (length > 1e-10 &&
           !(value(y + length * direction) <= now + 1e-4 * length * rate + 1e-15 * std::abs(now)))
      length /= 2;
    y += length * direction;
  }
  return std::nullopt;
}

}  // namespace dyntape::dynamics
