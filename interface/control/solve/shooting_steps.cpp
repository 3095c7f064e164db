// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/shooting_steps.h>

#include <algorithm>
#include <cmath>
#include <utility>

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
      point_(n_z_),
      value_(y_.rows()),
      weights_(VectorXd::Zero(y_.rows())),
      stages_(std::size_t(intervals), StageColumns(n_x_, problem.n_u())) {
  find_places();
  if (has_residuals()) before_.assign(stages_.begin(), stages_.end());
  if (step.order() >= Order::kSecond) H_.resize(Eigen::Index(step.hessian_pattern().nnz()));
  const Eigen::Index n_p = problem.parameters.size();
  const double h = problem.duration / intervals;
  for (int k = 0; k < intervals; ++k) {
    parameters_.col(k).head(2) << k * h, h;
    for (int part = 0; part < 3; ++part)
      parameters_.col(k).segment(2 + part * n_p, n_p) = problem.parameters.at((k + part / 2.0) * h);
  }
}

// Non-zeros come by rows: rows of F are columns of its transpose.
void ShootingSteps::find_places() {
  constexpr std::size_t kFew = 4;
  const Pattern& at = step_.jacobian_pattern();
  const Eigen::Index of_z = padded(n_z_);
  for (std::size_t i = 0; i < at.nnz(); ++i) {
    const Eigen::Index row = Eigen::Index(at.row[i]), col = Eigen::Index(at.col[i]);
    if (row > n_x_) {
      if (residuals_.empty() || at.row[residuals_.back().begin] != at.row[i])
        residuals_.push_back({i, i, -1});
      ++residuals_.back().end;
      continue;
    }
    std::vector<Run>& runs = row < n_x_ ? of_F_ : of_g_;
    const Eigen::Index to = row < n_x_ ? row * of_z + col : col;
    if (runs.empty() || runs.back().to + runs.back().count != to) runs.push_back({Eigen::Index(i), to, 0});
    ++runs.back().count;
  }
  Eigen::Index size = 0;
  for (Residual& r : residuals_)
    if (r.end - r.begin > kFew) r.dense = std::exchange(size, size + of_z);
  dense_.setZero(size);
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
  return are_finite(y_.data(), y_.size()) && are_finite(J_.data(), J_.size());
}

void ShootingSteps::place(std::size_t k) {
  const double* const J = J_.col(Eigen::Index(k)).data();
  StageColumns& s = stages_[k];
  if (has_residuals()) std::swap(static_cast<StageSlopes&>(s), before_[k]);
  for (const Run& run : of_F_) std::copy(J + run.from, J + run.from + run.count, s.Ft.data() + run.to);
  for (const Run& run : of_g_) std::copy(J + run.from, J + run.from + run.count, s.g.data() + run.to);
  if (!has_residuals()) return;
  s.H.setZero();
  for (const Residual& residual : residuals_) add_squares(residual, J, s.H);
}

// H / 2 = sum over the residuals of their gradients' squares.
void ShootingSteps::add_squares(const Residual& residual, const double* J, MatrixXd& H) {
  const std::uint32_t* const col = step_.jacobian_pattern().col.data();
  const Eigen::Index of_z = H.rows();
  if (residual.dense < 0) {
    for (std::size_t i = residual.begin; i < residual.end; ++i)
      for (std::size_t j = residual.begin; j < residual.end; ++j)
        H.data()[col[i] * of_z + col[j]] += 2 * J[i] * J[j];
    return;
  }
  double* const gradient = dense_.data() + residual.dense;
  for (std::size_t i = residual.begin; i < residual.end; ++i) gradient[col[i]] = J[i];
  for (std::size_t i = residual.begin; i < residual.end; ++i)
    add(H.data() + col[i] * of_z, 2 * J[i], gradient, of_z);
}

void ShootingSteps::curve(int k, const VectorXd& weights) {
  weights_.head(n_x_ + 1) = weights;
  step_.second_order(z_.col(k).data(), parameters_.col(k).data(), weights_.data(), nullptr, nullptr,
                     H_.data(), one_);
  MatrixXd& H = stages_[std::size_t(k)].H;
  const Pattern& at = step_.hessian_pattern();
  for (std::size_t i = 0; i < at.nnz(); ++i)
    H(at.row[i], at.col[i]) = H(at.col[i], at.row[i]) = H_[Eigen::Index(i)];
}

Trajectory held_motion(const Problem& problem, const VectorXd& t, const MatrixXd& x, const MatrixXd& u) {
  // Two points an interval, and the control of the first: what a verification has to know of such a motion.
  const Scheme held{"held", Eigen::Vector2d(0, 1), MatrixXd(0, 2), MatrixXd(0, 2), Eigen::Vector2d(1, 0), 4};
  Trajectory motion{t, x, MatrixXd::Zero(problem.n_a(), t.size()), MatrixXd(problem.n_u(), t.size()), held};
  motion.u << u, u.rightCols(1);
  return motion;
}

Verification verify_steps(const Problem& problem, const Trajectory& motion, double cost,
                          const std::stop_token& stop) {
  Verification v = verify(problem, motion, {}, stop);
  v.cost = cost;
  v.cost_error = std::abs(v.true_cost - cost) / v.cost_size;
  return v;
}

}  // namespace dyntape
