// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/shooting_steps.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/riccati/columns.h>

namespace dyntape {

using namespace columns;

using Eigen::MatrixXd;
using Eigen::VectorXd;

ShootingSteps::ShootingSteps(const CompiledFunction& step, const Problem& problem, int intervals)
    : step_(step),
      one_(step_),
      all_(step_),
      n_x_(problem.n_x()),
      n_z_(problem.n_x() + problem.n_u()),
      parameters_(2 + 3 * problem.parameters.size(), intervals),
      z_(n_z_, intervals),
      y_(Eigen::Index(step.n_y()), intervals),
      J_(Eigen::Index(step.jacobian_pattern().nnz()), intervals),
      first_gradient_((n_x_ + 1) * n_z_),
      dense_(VectorXd::Zero(first_gradient_ + (y_.rows() - n_x_ - 1) * padded(n_z_))),
      point_(n_z_),
      value_(y_.rows()),
      weights_(VectorXd::Zero(y_.rows())),
      stages_(std::size_t(intervals)) {
  if (has_residuals()) H_.resize(padded(n_z_) * n_z_);
  if (step.order() >= Order::kSecond) H_.resize(Eigen::Index(step.hessian_pattern().nnz()));
  const Pattern& at = step.jacobian_pattern();
  for (std::size_t i = 0; i < at.nnz(); ++i) {
    const Eigen::Index row = Eigen::Index(at.row[i]), col = Eigen::Index(at.col[i]);
    if (row <= n_x_) first_residual_ = i + 1;
    if (row < n_x_)
      places_.push_back(col * n_x_ + row);
    else if (row == n_x_)
      places_.push_back(n_x_ * n_z_ + col);
    else
      places_.push_back(first_gradient_ + (row - n_x_ - 1) * padded(n_z_) + col);
  }
  const Eigen::Index n_p = problem.parameters.size(), n_u = problem.n_u();
  const double h = problem.duration / intervals;
  for (int k = 0; k < intervals; ++k) {
    parameters_.col(k).head(2) << k * h, h;
    for (int part = 0; part < 3; ++part)
      parameters_.col(k).segment(2 + part * n_p, n_p) = problem.parameters.at((k + part / 2.0) * h);
  }
  for (LqrStage& s : stages_)
    s = {MatrixXd(n_x_, n_x_),
         MatrixXd(n_x_, n_u),
         VectorXd(n_x_),
         MatrixXd::Zero(n_z_, n_z_),
         VectorXd(n_z_),
         {},
         {}};
}

double ShootingSteps::run(int k, const Eigen::Ref<const VectorXd>& x, const Eigen::Ref<const VectorXd>& u,
                          Eigen::Ref<VectorXd> next) {
  point_ << x, u;
  step_.value(point_.data(), parameters_.col(k).data(), value_.data(), one_);
  next = value_.head(n_x_);
  return value_[n_x_];
}

VectorXd ShootingSteps::run_side_by_side(MatrixXd& x, const std::function<void(int k, MatrixXd& u)>& set) {
  const Eigen::Index count = x.cols();
  MatrixXd u, z(n_z_, count), p(parameters_.rows(), count), y(y_.rows(), count);
  const Points points{.count = std::size_t(count), .x = z.data(), .p = p.data(), .y = y.data()};
  VectorXd costs = VectorXd::Zero(count);
  for (int k = 0; k < int(parameters_.cols()); ++k) {
    set(k, u);
    z << x, u;
    p.colwise() = parameters_.col(k);
    step_.check(step_.run(Order::kValue, points, all_), points.count);
    x = y.topRows(n_x_);
    costs += y.row(n_x_).transpose();
  }
  return costs;
}

bool ShootingSteps::linearise(const MatrixXd& x, const MatrixXd& u) {
  z_ << x.leftCols(z_.cols()), u;
  const Points points{.count = std::size_t(z_.cols()),
                      .x = z_.data(),
                      .p = parameters_.data(),
                      .y = y_.data(),
                      .jacobian = J_.data()};
  step_.check(step_.run(Order::kFirst, points, all_), points.count);
  for (std::size_t k = 0; k < stages_.size(); ++k) place(k);
  return y_.allFinite() && J_.allFinite();
}

void ShootingSteps::place(std::size_t k) {
  const Pattern& at = step_.jacobian_pattern();
  const double* const J = J_.col(Eigen::Index(k)).data();
  for (std::size_t i = 0; i < at.nnz(); ++i) dense_[places_[i]] = J[i];
  LqrStage& s = stages_[k];
  const double* const F = dense_.data();
  std::copy(F, F + s.A.size(), s.A.data());
  std::copy(F + s.A.size(), F + n_x_ * n_z_, s.B.data());
  s.g = dense_.segment(n_x_ * n_z_, n_z_);
  if (!has_residuals()) return;
  // H / 2 = sum over the residuals of their gradients' squares.
  const Eigen::Index of_z = padded(n_z_);
  H_.setZero();
  for (std::size_t i = first_residual_; i < at.nnz(); ++i) {
    const Eigen::Index r = Eigen::Index(at.row[i]) - n_x_ - 1, j = Eigen::Index(at.col[i]),
                       from = j / kPad * kPad;
    add(H_.data() + j * of_z + from, 2 * J[i], F + first_gradient_ + r * of_z + from, of_z - from);
  }
  for (Eigen::Index j = 0; j < n_z_; ++j)
    std::copy(H_.data() + j * of_z + j, H_.data() + j * of_z + n_z_, s.H.data() + j * n_z_ + j);
}

void ShootingSteps::curve(int k, const VectorXd& weights) {
  weights_.head(n_x_ + 1) = weights;
  step_.second_order(z_.col(k).data(), parameters_.col(k).data(), weights_.data(), nullptr, nullptr,
                     H_.data(), one_);
  MatrixXd& H = stages_[std::size_t(k)].H;
  const Pattern& at = step_.hessian_pattern();
  for (std::size_t i = 0; i < at.nnz(); ++i) H(at.row[i], at.col[i]) = H_[Eigen::Index(i)];
}

double error_of_steps(const Problem& problem, const VectorXd& t, const MatrixXd& x, const MatrixXd& u,
                      const std::stop_token& stop) {
  double worst = 0;
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    if (stop.stop_requested()) return std::nan("");
    const VectorXd held = u.col(k);
    const Simulation run = simulate(problem, x.col(k), t[k], t[k + 1], [&](double) { return held; });
    if (!run.x.allFinite()) return std::nan("");
    worst = std::max(worst, (run.x - x.col(k + 1)).cwiseAbs().maxCoeff());
  }
  return worst;
}

}  // namespace dyntape
