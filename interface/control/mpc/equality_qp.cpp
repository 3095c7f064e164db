// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/mpc/equality_qp.h>

#include <cmath>

namespace dyntape {

namespace {

constexpr double kGood = 1e-9;  // of the right side: what rounding, and rows held by springs, may leave

bool is_limited(double lower, double upper) {
  return lower != upper && (lower > -HUGE_VAL || upper < HUGE_VAL);
}

}  // namespace

bool EqualityQp::fits(const NlpShape& shape) {
  for (std::size_t i = 0; i < shape.n(); ++i) {
    if (is_limited(shape.x_lower[i], shape.x_upper[i])) return false;
  }
  for (std::size_t j = 0; j < shape.m(); ++j) {
    if (is_limited(shape.g_lower[j], shape.g_upper[j])) return false;
  }
  return true;
}

EqualityQp::EqualityQp(QpSubproblem& model) : model_(model), kkt_(model, true) {
  const auto n = Eigen::Index(model.shape().n()), m = Eigen::Index(model.shape().m());
  for (KktVector* v : {&right_, &step_}) v->x.setZero(n), v->s.setZero(m), v->c.setZero(m);
  diagonal_.sigma_x.setZero(n), diagonal_.sigma_s.setZero(m);
}

NlpSolution EqualityQp::solve() {
  const NlpShape& shape = model_.shape();
  const std::vector<double>&x = model_.x(), &g = model_.g(), &gradient = model_.gradient();
  NlpSolution next;
  next.x = x;
  next.lambda.assign(g.size(), 0.0);
  next.lower_multiplier.assign(x.size(), 0.0), next.upper_multiplier.assign(x.size(), 0.0);
  kkt_.set(model_.jacobian().data(), model_.hessian().data());
  for (std::size_t i = 0; i < x.size(); ++i) right_.x[Eigen::Index(i)] = kkt_.is_fixed(i) ? 0 : -gradient[i];
  for (std::size_t j = 0; j < g.size(); ++j)
    right_.c[Eigen::Index(j)] = kkt_.kind(j) == RowKind::kFree ? 0 : shape.g_lower[j] - g[j];
  has_factor_ = kkt_.factor(diagonal_);
  next.status = SolveStatus::kStepFailed;
  if (has_factor_) {
    kkt_.solve(right_, step_, kGood);
    if (step_.x.allFinite() && step_.c.allFinite()) {
      for (std::size_t i = 0; i < x.size(); ++i) next.x[i] += step_.x[Eigen::Index(i)];
      next.lambda.assign(step_.c.begin(), step_.c.end());
      next.status = SolveStatus::kSolved;
    }
  }
  model_.objective(next.x.data(), next.objective);
  next.g.resize(g.size());
  model_.constraints(next.x.data(), next.g.data());
  return next;
}

Eigen::MatrixXd EqualityQp::derivatives(const std::vector<std::size_t>& held) {
  if (!has_factor_) return {};
  Eigen::MatrixXd derivatives = kkt_.follow(held);
  return derivatives.allFinite() ? derivatives : Eigen::MatrixXd();
}

}  // namespace dyntape
