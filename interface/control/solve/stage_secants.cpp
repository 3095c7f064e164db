// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/stage_secants.h>

#include <cmath>
#include <limits>
#include <utility>

#include <dyntape/interface/control/riccati/columns.h>

namespace dyntape {

using namespace columns;

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void StageSecants::learn(const std::vector<StageColumns>& stages, const std::vector<StageSlopes>& before,
                         const MatrixXd& x, const MatrixXd& u, const MatrixXd& adjoint) {
  constexpr double kFarOff = 0.2;
  const bool is_first = S_.empty();
  if (is_first) begin(stages);
  find_steps(x, u);
  if (is_first) return;
  Curvatures along;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const auto at = Index(k);
    change(S_[k], stages[k], before[k], s_.col(at).data(), adjoint.col(at + 1).data(), along);
  }
  help_ = std::abs(along.left) < std::abs(along.missing) && std::abs(along.missing) > kFarOff * along.known;
}

void StageSecants::begin(const std::vector<StageColumns>& stages) {
  const MatrixXd& H = stages.front().H;
  const Index rows = H.rows();
  S_.assign(stages.size(), MatrixXd::Zero(rows, H.cols()));
  z_ = s_ = MatrixXd::Zero(rows, Index(stages.size()));
  size_ = VectorXd::Ones(rows);
  y_ = r_ = w_ = squares_ = scaled_ = VectorXd::Zero(rows);
}

void StageSecants::find_steps(const MatrixXd& x, const MatrixXd& u) {
  const Index n = x.rows(), m = u.rows();
  std::swap(z_, s_);
  z_.topRows(n) = x.leftCols(z_.cols()), z_.middleRows(n, m) = u;
  s_ = z_ - s_;
  // Behind the entries nothing moves, and what lies there is divided by one.
  size_.head(n + m).setConstant(std::numeric_limits<double>::min());
  for (const auto& step : s_.colwise())
    size_.head(n + m) = size_.head(n + m).cwiseMax(step.head(n + m).cwiseAbs());
}

// y_: that of g + F^T lambda; and how far rounding may be off.
double StageSecants::change_of_slope(const StageColumns& now, const StageSlopes& before,
                                     const double* lambda) {
  constexpr double kRounding = 1e-13;
  const Index rows = y_.size();
  double* const y = y_.data();
  double* const squares = squares_.data();
  for (Index i = 0; i < rows; ++i) y[i] = now.g[i] - before.g[i], squares[i] = 0;
  double of_lambda = 0;
  for (Index r = 0; r < now.n; ++r) {
    const double *const a = now.Ft.col(r).data(), *const b = before.Ft.col(r).data(), weight = lambda[r];
    for (Index i = 0; i < rows; ++i) y[i] += weight * (a[i] - b[i]);
    for (Index i = 0; i < rows; ++i) squares[i] += a[i] * a[i];
    of_lambda += weight * weight;
  }
  const double of_A = squares_.head(now.n).sum(), of_B = squares_.segment(now.n, now.m).sum(),
               of_g = padded_dot(now.g.data(), now.g.data(), rows);
  return kRounding * (std::sqrt(of_g) + (std::sqrt(of_A) + std::sqrt(of_B)) * std::sqrt(of_lambda));
}

void StageSecants::change(MatrixXd& S, const StageColumns& now, const StageSlopes& before, const double* s,
                          const double* lambda, Curvatures& along) {
  constexpr double kWorse = 2, kSkipped = 1e-2;
  const Index rows = y_.size();
  const double noise = change_of_slope(now, before, lambda);
  along.known += curvature(now.H, s, w_);
  y_ -= w_;
  w_.setZero();
  add_columns(w_.data(), S.data(), rows, s, S.cols(), rows);
  r_ = y_ - w_;
  const auto product = [&](const VectorXd& a, const double* b) { return padded_dot(a.data(), b, rows); };
  along.missing += product(y_, s), along.left += product(r_, s);
  if (!(std::sqrt(product(r_, r_.data())) > noise)) return;
  const auto scaled = [&](const VectorXd& slope) {
    scaled_ = slope.cwiseProduct(size_);
    return std::sqrt(product(scaled_, scaled_.data()));
  };
  if (scaled(r_) > kWorse * scaled(y_)) S.setZero(), r_ = y_;
  const double of_step = product(r_, s);
  for (Index i = 0; i < rows; ++i) w_[i] = s[i] / size_[i];
  if (!(std::abs(of_step) > kSkipped * scaled(r_) * std::sqrt(product(w_, w_.data())))) return;
  w_ = r_ / of_step;
  for (Index j = 0; j < S.cols(); ++j) add(S.col(j).data(), w_[j], r_.data(), rows);
}

}  // namespace dyntape
