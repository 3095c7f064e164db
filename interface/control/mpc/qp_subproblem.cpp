// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/mpc/qp_subproblem.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

QpSubproblem::QpSubproblem(Nlp& nlp)
    : nlp_(nlp),
      shape_(nlp.shape()),
      g_(shape_.m()),
      gradient_(shape_.n()),
      jacobian_(shape_.jacobian.nnz()),
      hessian_(shape_.hessian.nnz()),
      curved_(shape_.n()) {}

void QpSubproblem::take_bounds() {
  const NlpShape& own = nlp_.shape();
  shape_.x_lower = own.x_lower, shape_.x_upper = own.x_upper;
  shape_.g_lower = own.g_lower, shape_.g_upper = own.g_upper;
}

bool QpSubproblem::expand(const std::vector<double>& x, const std::vector<double>& lambda) {
  x_ = x;
  // What needs most first: at the same point that brings the others along.
  return nlp_.hessian(x.data(), 1, lambda.data(), hessian_.data()) &&
         nlp_.jacobian(x.data(), jacobian_.data()) && nlp_.gradient(x.data(), gradient_.data()) &&
         nlp_.objective(x.data(), f_) && nlp_.constraints(x.data(), g_.data());
}

void QpSubproblem::curve(const double* x) {
  std::fill(curved_.begin(), curved_.end(), 0.0);
  const Pattern& H = shape_.hessian;
  for (std::size_t e = 0; e < H.nnz(); ++e) {
    const std::size_t i = H.row[e], j = H.col[e];
    curved_[i] += hessian_[e] * (x[j] - x_[j]);
    if (i != j) curved_[j] += hessian_[e] * (x[i] - x_[i]);
  }
}

bool QpSubproblem::objective(const double* x, double& value) {
  curve(x);
  value = f_;
  for (std::size_t i = 0; i < x_.size(); ++i) value += (gradient_[i] + curved_[i] / 2) * (x[i] - x_[i]);
  return std::isfinite(value);
}

bool QpSubproblem::gradient(const double* x, double* gradient) {
  curve(x);
  for (std::size_t i = 0; i < x_.size(); ++i) gradient[i] = gradient_[i] + curved_[i];
  return true;
}

bool QpSubproblem::constraints(const double* x, double* g) {
  std::copy(g_.begin(), g_.end(), g);
  const Pattern& J = shape_.jacobian;
  for (std::size_t e = 0; e < J.nnz(); ++e) g[J.row[e]] += jacobian_[e] * (x[J.col[e]] - x_[J.col[e]]);
  return true;
}

bool QpSubproblem::jacobian(const double*, double* nonzeros) {
  std::copy(jacobian_.begin(), jacobian_.end(), nonzeros);
  return true;
}

bool QpSubproblem::hessian(const double*, double sigma, const double*, double* nonzeros) {
  std::transform(hessian_.begin(), hessian_.end(), nonzeros, [=](double value) { return sigma * value; });
  return true;
}

}  // namespace dyntape
